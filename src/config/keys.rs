//! The keys that a site file may have, as its reader asks for them.

use std::collections::BTreeMap;

/// What may stand behind a key.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ValueShape {
    /// A string.
    Text,
    /// A list of strings.
    Texts,
    /// A string, or a list of them.
    TextOrTexts,
    /// true or false.
    Switch,
    /// A number.
    Number,
    /// A number strictly between 0 and 1.
    Chance,
    /// A list of numbers.
    Numbers,
    /// A list of numbers and strings.
    Marks,
    /// A table, by its name in messages.
    Table(&'static str),
    /// A list of tables, by their name in messages.
    Tables(&'static str),
}

/// One key of a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Key {
    /// As it stands in the file.
    pub name: &'static str,
    /// What may stand behind it.
    pub shape: ValueShape,
    /// Whether the file is refused without it.
    pub is_required: bool,
}

/// The keys of each table, by its name in messages; that of the whole file is empty.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Keys {
    /// By table, in the order in which they were asked for.
    pub tables: BTreeMap<&'static str, Vec<Key>>,
}

impl Keys {
    /// Adds what was asked of one table. Of several tables of a name a key is required where it is in each.
    pub(super) fn add(&mut self, table: &'static str, asked: &[Key]) {
        let Some(known) = self.tables.get_mut(table) else {
            self.tables.insert(table, asked.to_vec());
            return;
        };
        for key in known.iter_mut() {
            let again = asked.iter().find(|one| one.name == key.name);
            key.is_required &= again.is_some_and(|again| again.is_required);
        }
        for key in asked {
            if known.iter().all(|one| one.name != key.name) {
                known.push(Key {
                    is_required: false,
                    ..*key
                });
            }
        }
    }
}
