//! Typed reading of one TOML table: every key asked for is known, every other one is a problem.

use super::keys::{Key, ValueShape};
use super::problem::{ConfigProblem, ConfigProblems, Severity};
use std::cell::RefCell;
use std::collections::BTreeSet;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A value and where it stands.
#[derive(Debug, Clone)]
pub(super) struct Placed<T> {
    pub(super) value: T,
    pub(super) at: Range<usize>,
}

/// One table of the site file while it is being read.
#[derive(Debug)]
pub(super) struct Section<'t> {
    name: &'static str,
    table: Option<&'t DeTable<'t>>,
    at: Range<usize>,
    asked: Vec<Key>,
    problems: &'t RefCell<ConfigProblems>,
}

impl<'t> Section<'t> {
    /// The whole document.
    pub(super) fn root(table: &'t DeTable<'t>, problems: &'t RefCell<ConfigProblems>) -> Self {
        Self {
            name: "",
            table: Some(table),
            at: 0..0,
            asked: Vec::new(),
            problems,
        }
    }

    /// Where the table begins.
    pub(super) fn at(&self) -> &Range<usize> {
        &self.at
    }

    /// Whether the file has this key, rightly written or not.
    pub(super) fn has(&self, key: &str) -> bool {
        self.table.is_some_and(|table| table.contains_key(key))
    }

    pub(super) fn error(&self, at: &Range<usize>, what: String, fix: impl Into<String>) {
        self.problems.borrow_mut().error(at, what, fix);
    }

    /// A warning that is given only where something else bears it out.
    pub(super) fn doubt(&self, at: &Range<usize>, what: String, fix: &str) -> ConfigProblem {
        let problems = self.problems.borrow();
        problems.problem(Severity::Warning, at, what, fix.to_owned())
    }

    pub(super) fn warning(&self, at: &Range<usize>, what: String, fix: impl Into<String>) {
        self.problems.borrow_mut().warning(at, what, fix);
    }

    /// `alert.outlook`, as messages name it.
    pub(super) fn path(&self, key: &str) -> String {
        if self.name.is_empty() {
            key.to_owned()
        } else {
            format!("{}.{key}", self.name)
        }
    }

    fn get(&mut self, key: &'static str, shape: ValueShape) -> Option<&'t Spanned<DeValue<'t>>> {
        self.ask(key, shape);
        self.table?.get(key)
    }

    fn ask(&mut self, name: &'static str, shape: ValueShape) {
        if self.asked.iter().all(|known| known.name != name) {
            self.asked.push(Key {
                name,
                shape,
                is_required: false,
            });
        }
    }

    fn wrong_type(&self, key: &str, value: &Spanned<DeValue<'_>>, wanted: &str, example: &str) {
        let found = value.get_ref().type_str();
        self.error(
            &value.span(),
            format!("{} is of type {found}, not {wanted}", self.path(key)),
            format!("write {example}"),
        );
    }

    /// A string.
    pub(super) fn text(&mut self, key: &'static str) -> Option<Placed<String>> {
        let value = self.get(key, ValueShape::Text)?;
        let Some(text) = value.get_ref().as_str() else {
            self.wrong_type(key, value, "a string", &format!("{key} = \"...\""));
            return None;
        };
        Some(Placed {
            value: text.to_owned(),
            at: value.span(),
        })
    }

    /// A string that must be there and not be empty.
    pub(super) fn required(&mut self, key: &'static str, example: &str) -> Option<Placed<String>> {
        self.ask(key, ValueShape::Text);
        if let Some(asked) = self.asked.iter_mut().find(|known| known.name == key) {
            asked.is_required = true;
        }
        if !self.has(key) {
            self.error(
                &self.at,
                format!("{} is missing", self.path(key)),
                format!("add {key} = {example}"),
            );
            return None;
        }
        let text = self.text(key)?;
        if text.value.trim().is_empty() {
            self.error(
                &text.at,
                format!("{} is empty", self.path(key)),
                format!("write {key} = {example}"),
            );
            return None;
        }
        Some(text)
    }

    /// A string with a meaning; `Err` says what to write instead.
    pub(super) fn parsed<T>(
        &mut self,
        key: &'static str,
        parse: impl FnOnce(&str) -> Result<T, String>,
    ) -> Option<Placed<T>> {
        let text = self.text(key)?;
        match parse(&text.value) {
            Ok(value) => Some(Placed { value, at: text.at }),
            Err(fix) => {
                self.error(
                    &text.at,
                    format!("{} = {:?} cannot be used", self.path(key), text.value),
                    fix,
                );
                None
            }
        }
    }

    /// true or false.
    pub(super) fn switch(&mut self, key: &'static str) -> Option<bool> {
        let value = self.get(key, ValueShape::Switch)?;
        let DeValue::Boolean(switch) = value.get_ref() else {
            self.wrong_type(key, value, "true or false", &format!("{key} = true"));
            return None;
        };
        Some(*switch)
    }

    /// Any number that is finite.
    pub(super) fn number(&mut self, key: &'static str) -> Option<Placed<f64>> {
        let value = self.get(key, ValueShape::Number)?;
        let Some(number) = number(value.get_ref()).filter(|number| number.is_finite()) else {
            self.wrong_type(key, value, "a number", &format!("{key} = 74.0"));
            return None;
        };
        Some(Placed {
            value: number,
            at: value.span(),
        })
    }

    /// A number strictly between 0 and 1; `example` is one that can be meant.
    pub(super) fn chance(&mut self, key: &'static str, example: f64) -> Option<f64> {
        let value = self.get(key, ValueShape::Chance)?;
        match number(value.get_ref()) {
            Some(number) if number > 0.0 && number < 1.0 => Some(number),
            Some(_) | None => {
                self.error(
                    &value.span(),
                    format!("{} is not a chance", self.path(key)),
                    format!("write a number between 0 and 1, such as {example}"),
                );
                None
            }
        }
    }

    /// A list of numbers and strings, each as its text.
    pub(super) fn marks(&mut self, key: &'static str) -> Option<Placed<Vec<String>>> {
        let mark = |value: &DeValue<'_>| {
            let text = value.as_str().map(str::to_owned);
            text.or_else(|| number(value).map(|number| number.to_string()))
        };
        let example = format!("{key} = [-7999, \"NAN\"]");
        self.list(
            key,
            ValueShape::Marks,
            "a number or a string",
            &example,
            mark,
        )
    }

    /// A string, or a list of them, of which none is empty.
    pub(super) fn text_or_texts(&mut self, key: &'static str) -> Option<Placed<Vec<String>>> {
        let is_list = self
            .get(key, ValueShape::TextOrTexts)?
            .get_ref()
            .as_array()
            .is_some();
        if !is_list {
            let text = self.text(key)?;
            return Some(Placed {
                value: vec![text.value],
                at: text.at,
            });
        }
        let words = self.texts(key)?;
        Some(Placed {
            value: words.value.into_iter().map(|word| word.value).collect(),
            at: words.at,
        })
    }

    /// A list of numbers.
    pub(super) fn numbers(&mut self, key: &'static str) -> Option<Placed<Vec<f64>>> {
        let example = format!("{key} = [0.7, 0.6, -0.4]");
        self.list(key, ValueShape::Numbers, "a number", &example, number)
    }

    fn list<T>(
        &mut self,
        key: &'static str,
        shape: ValueShape,
        wanted: &str,
        example: &str,
        read: impl Fn(&DeValue<'_>) -> Option<T>,
    ) -> Option<Placed<Vec<T>>> {
        let value = self.get(key, shape)?;
        let Some(array) = value.get_ref().as_array() else {
            self.wrong_type(key, value, "a list", example);
            return None;
        };
        let mut read_ones = Vec::new();
        for item in array {
            match read(item.get_ref()) {
                Some(one) => read_ones.push(one),
                None => self.wrong_type(key, item, wanted, example),
            }
        }
        Some(Placed {
            value: read_ones,
            at: value.span(),
        })
    }

    /// A list of strings.
    pub(super) fn texts(&mut self, key: &'static str) -> Option<Placed<Vec<Placed<String>>>> {
        let value = self.get(key, ValueShape::Texts)?;
        let example = format!("{key} = [\"...\"]");
        let Some(array) = value.get_ref().as_array() else {
            self.wrong_type(key, value, "a list of strings", &example);
            return None;
        };
        let mut texts = Vec::new();
        for item in array {
            match item.get_ref().as_str() {
                Some(text) => texts.push(Placed {
                    value: text.to_owned(),
                    at: item.span(),
                }),
                None => self.wrong_type(key, item, "a string", &example),
            }
        }
        Some(Placed {
            value: texts,
            at: value.span(),
        })
    }

    /// The table under `key`; one without keys where the file has none.
    pub(super) fn table(&mut self, key: &'static str, name: &'static str) -> Section<'t> {
        let (table, at) = match self.get(key, ValueShape::Table(name)) {
            None => (None, self.at.clone()),
            Some(value) => {
                let table = value.get_ref().as_table();
                if table.is_none() {
                    self.wrong_type(key, value, "a table", &format!("[{name}]"));
                }
                (table, value.span())
            }
        };
        self.child(name, table, at)
    }

    /// The tables under `key`, in the order of the file.
    pub(super) fn tables(&mut self, key: &'static str, name: &'static str) -> Vec<Section<'t>> {
        let Some(value) = self.get(key, ValueShape::Tables(name)) else {
            return Vec::new();
        };
        let example = format!("[[{name}]]");
        let Some(array) = value.get_ref().as_array() else {
            self.wrong_type(key, value, "a list of tables", &example);
            return Vec::new();
        };
        let mut sections = Vec::new();
        for item in array {
            match item.get_ref().as_table() {
                Some(table) => sections.push(self.child(name, Some(table), item.span())),
                None => self.wrong_type(key, item, "a table", &example),
            }
        }
        sections
    }

    fn child(
        &self,
        name: &'static str,
        table: Option<&'t DeTable<'t>>,
        at: Range<usize>,
    ) -> Section<'t> {
        Section {
            name,
            table,
            at,
            asked: Vec::new(),
            problems: self.problems,
        }
    }

    /// Reports the keys that nothing asked for.
    pub(super) fn finish(self) {
        self.problems.borrow_mut().keys.add(self.name, &self.asked);
        let Some(table) = self.table else { return };
        for (key, _) in table {
            let name: &str = key.get_ref();
            if self.asked.iter().all(|known| known.name != name) {
                let known: Vec<&str> = self.asked.iter().map(|known| known.name).collect();
                self.error(
                    &key.span(),
                    format!("unknown key {}", self.path(name)),
                    format!("known here: {}", known.join(", ")),
                );
            }
        }
    }
}

/// The number that a value is.
fn number(value: &DeValue<'_>) -> Option<f64> {
    match value {
        DeValue::Float(float) => float.as_str().replace('_', "").parse().ok(),
        DeValue::Integer(integer) => integer.as_str().parse().ok(),
        DeValue::String(_)
        | DeValue::Boolean(_)
        | DeValue::Datetime(_)
        | DeValue::Array(_)
        | DeValue::Table(_) => None,
    }
}

/// Notes an id, and that it is there twice where it is.
pub(super) fn unique(
    section: &Section<'_>,
    id: Option<&Placed<String>>,
    taken: &mut BTreeSet<String>,
) {
    let Some(id) = id else { return };
    if !taken.insert(id.value.clone()) {
        section.error(
            &id.at,
            format!("{} = {:?} is there twice", section.path("id"), id.value),
            "give each its own id",
        );
    }
}
