//! Arrows among the modules go one way, the core is pure, and files stay small.
//!
//! The sources are read as text: a small tokeniser finds every path (`crate::fit::Rate`, a `use` with
//! braces, a chain of `super`), outside comments, strings and the `#[cfg(test)]` part of a file.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Which modules a module may name. A new module gets a row here, and a place in ARCHITECTURE.md.
const ARROWS: [(&str, &[&str]); 16] = [
    ("reading", &[]),
    ("regime", &[]),
    ("plot", &[]),
    ("model", &["regime"]),
    ("fit", &["model", "reading", "regime"]),
    ("forecast", &["fit", "model", "reading", "regime"]),
    (
        "effects",
        &["fit", "forecast", "model", "reading", "regime"],
    ),
    (
        "figures",
        &[
            "alert", "effects", "fit", "forecast", "monitor", "plot", "reading", "score",
        ],
    ),
    ("alert", &["reading"]),
    (
        "monitor",
        &[
            "alert", "effects", "fit", "forecast", "model", "reading", "regime",
        ],
    ),
    (
        "inversion",
        &["fit", "forecast", "model", "reading", "regime"],
    ),
    ("score", &["fit", "forecast", "model", "reading"]),
    ("config", &["alert", "monitor", "reading"]),
    ("store", &["monitor", "reading"]),
    (
        "runtime",
        &[
            "alert", "config", "fit", "forecast", "monitor", "reading", "regime", "store",
        ],
    ),
    (
        "cli",
        &[
            "alert",
            "config",
            "effects",
            "figures",
            "fit",
            "inversion",
            "model",
            "monitor",
            "plot",
            "reading",
            "regime",
            "runtime",
            "score",
            "store",
        ],
    ),
];

/// Modules that know no clock, no files, no network and no ambient randomness.
const PURE: [&str; 12] = [
    "reading",
    "regime",
    "plot",
    "model",
    "fit",
    "forecast",
    "effects",
    "figures",
    "alert",
    "monitor",
    "inversion",
    "score",
];

/// Beginnings of paths that a pure module may not have.
const IMPURE_PATHS: [&[&str]; 12] = [
    &["tokio"],
    &["std", "fs"],
    &["std", "net"],
    &["std", "env"],
    &["std", "process"],
    &["std", "thread"],
    &["std", "time", "Instant"],
    &["std", "time", "SystemTime"],
    &["std", "time", "*"],
    &["jiff", "Zoned", "now"],
    &["rand", "rng"],
    &["rand", "random"],
];

/// Names that are impure whatever stands before them.
const IMPURE_NAMES: [&str; 7] = [
    "Instant",
    "SystemTime",
    "OsRng",
    "SysRng",
    "ThreadRng",
    "thread_rng",
    "from_os_rng",
];

/// Lines of a file without its tests.
const LONGEST_FILE: usize = 500;

/// Arguments of a function, as in clippy.toml; the members of a tuple count each.
const MOST_ARGUMENTS: usize = 7;

/// Names of types that stand more than once: the flags of each command.
const NAMED_TWICE: [&str; 1] = ["Args"];

/// One source file: its module's path and the text of what is not a test.
struct Source {
    file: PathBuf,
    module: Vec<String>,
    text: String,
}

fn sources() -> Vec<Source> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut folders = vec![root.clone()];
    let mut sources = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let file = entry.unwrap().path();
            if file.is_dir() {
                folders.push(file);
            } else if file.extension().is_some_and(|extension| extension == "rs") {
                let module = module_of(file.strip_prefix(&root).unwrap());
                let text = without_tests(&std::fs::read_to_string(&file).unwrap()).to_owned();
                sources.push(Source { file, module, text });
            }
        }
    }
    sources.sort_by(|a, b| a.file.cmp(&b.file));
    assert!(sources.len() > 50, "{} files", sources.len());
    sources
}

/// `fit/rates.rs` is fit, rates; `fit/mod.rs` is fit; `lib.rs` is the crate itself.
fn module_of(file: &Path) -> Vec<String> {
    let file = file.with_extension("");
    let names = file.iter().map(|name| name.to_str().unwrap().to_owned());
    names
        .filter(|name| !["mod", "lib", "main"].contains(&name.as_str()))
        .collect()
}

/// The text up to the module of tests that closes it. One that lies in a file of its own ends nothing.
fn without_tests(text: &str) -> &str {
    let opens_tests = |at: usize| {
        let rest = text[at..].trim_start().strip_prefix("mod ");
        rest.is_some_and(|rest| {
            let opens = rest.find(['{', ';']);
            opens.is_some_and(|at| rest[at..].starts_with('{'))
        })
    };
    let tests = text
        .match_indices("#[cfg(test)]")
        .find(|(at, mark)| opens_tests(at + mark.len()));
    tests.map_or(text, |(at, _)| &text[..at])
}

/// Names, `::` and single other characters, without comments and literals.
fn tokens(text: &str) -> Vec<String> {
    let mut rest = text;
    let mut tokens = Vec::new();
    while let Some(c) = rest.chars().next() {
        let length = if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if rest.starts_with("/*") {
            rest.find("*/").map_or(rest.len(), |at| at + 2)
        } else if let Some(length) = raw_string(rest) {
            length
        } else if c == '"' {
            quoted(rest, '"')
        } else if c == '\'' {
            character(rest)
        } else if c.is_alphanumeric() || c == '_' {
            let word = |c: char| c.is_alphanumeric() || c == '_';
            let length = rest.find(|c| !word(c)).unwrap_or(rest.len());
            tokens.push(rest[..length].to_owned());
            length
        } else if rest.starts_with("::") {
            tokens.push("::".to_owned());
            2
        } else {
            if !c.is_whitespace() {
                tokens.push(c.to_string());
            }
            c.len_utf8()
        };
        rest = &rest[length..];
    }
    tokens
}

/// The length of `r"…"`, `r#"…"#`, `br"…"` at the start of `text`.
fn raw_string(text: &str) -> Option<usize> {
    let after = text.strip_prefix("br").or_else(|| text.strip_prefix('r'))?;
    let hashes = after.find(|c| c != '#')?;
    let body = after[hashes..].strip_prefix('"')?;
    let close = format!("\"{}", "#".repeat(hashes));
    let end = body.find(&close)? + close.len();
    Some(text.len() - body.len() + end)
}

/// The length of a literal in quotes, escapes included.
fn quoted(text: &str, quote: char) -> usize {
    let mut is_escaped = false;
    for (at, c) in text.char_indices().skip(1) {
        if c == quote && !is_escaped {
            return at + c.len_utf8();
        }
        is_escaped = c == '\\' && !is_escaped;
    }
    text.len()
}

/// The length of a character literal; of a lifetime only its mark.
fn character(text: &str) -> usize {
    let mut after = text.chars().skip(1);
    match (after.next(), after.next()) {
        (Some('\\'), _) | (Some(_), Some('\'')) => quoted(text, '\''),
        _ => 1,
    }
}

/// Every path with a `::` in it, the braces of a `use` multiplied out.
fn paths(text: &str) -> Vec<Vec<String>> {
    let tokens = tokens(text);
    let mut found = Vec::new();
    let mut at = 0;
    while at < tokens.len() {
        if is_name(&tokens[at]) {
            at = path(&tokens, at, &[], &mut found);
        } else {
            at += 1;
        }
    }
    found.retain(|path| path.len() > 1);
    found
}

fn is_name(token: &str) -> bool {
    token.starts_with(|c: char| c.is_alphanumeric() || c == '_')
}

/// Reads one path behind `prefix` and returns where it ends.
fn path(tokens: &[String], start: usize, prefix: &[String], found: &mut Vec<Vec<String>>) -> usize {
    let token = |at: usize| tokens.get(at).map_or("", String::as_str);
    let mut path_so_far = prefix.to_vec();
    let mut at = start;
    loop {
        if token(at) == "{" {
            return group(tokens, at + 1, &path_so_far, found);
        }
        if !(is_name(token(at)) || token(at) == "*") {
            break;
        }
        path_so_far.push(tokens[at].clone());
        at += 1;
        if token(at) != "::" {
            break;
        }
        at += 1;
    }
    found.push(path_so_far);
    at
}

/// Reads the paths in braces and returns where they close.
fn group(
    tokens: &[String],
    start: usize,
    prefix: &[String],
    found: &mut Vec<Vec<String>>,
) -> usize {
    let mut at = start;
    while let Some(token) = tokens.get(at) {
        at = match token.as_str() {
            "}" => return at + 1,
            // Another name is no path.
            "as" => at + 2,
            name if is_name(name) || name == "*" => path(tokens, at, prefix, found),
            _ => at + 1,
        };
    }
    at
}

/// The module of the crate that `path` leads to from within `module`.
fn target<'a>(module: &[String], path: &'a [String]) -> Option<&'a str> {
    let ups = path.iter().take_while(|name| *name == "super").count();
    if path[0] == "crate" {
        path.get(1).map(String::as_str)
    } else if ups > 0 && ups == module.len() {
        path.get(ups).map(String::as_str)
    } else {
        None
    }
}

/// The arrows that `text` in `module` draws to other modules.
fn arrows(module: &[String], text: &str) -> BTreeSet<String> {
    let paths = paths(text);
    let targets = paths.iter().filter_map(|path| target(module, path));
    targets
        .filter(|target| module.first().is_none_or(|own| own != target))
        .map(str::to_owned)
        .collect()
}

/// What in `text` has no place in a pure module.
fn impurities(text: &str) -> BTreeSet<String> {
    let of_paths = paths(text).into_iter().filter(|path| {
        let begins = |impure: &&[&str]| path.iter().zip(impure.iter()).all(|(a, b)| a == b);
        IMPURE_PATHS
            .iter()
            .any(|impure| path.len() >= impure.len() && begins(impure))
    });
    let of_names = tokens(text).into_iter();
    of_paths
        .map(|path| path.join("::"))
        .chain(of_names.filter(|name| IMPURE_NAMES.contains(&name.as_str())))
        .collect()
}

#[test]
fn arrows_among_modules_go_one_way() {
    let allowed = BTreeMap::from(ARROWS);
    let mut wrong = Vec::new();
    for source in sources() {
        let Some(module) = source.module.first() else {
            continue; // lib.rs and main.rs
        };
        let Some(allowed) = allowed.get(module.as_str()) else {
            wrong.push(format!("{module} has no row in ARROWS"));
            continue;
        };
        for arrow in arrows(&source.module, &source.text) {
            if !allowed.contains(&arrow.as_str()) {
                wrong.push(format!("{}: {module} -> {arrow}", source.file.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn the_table_of_arrows_has_no_circle() {
    let mut left = BTreeMap::from(ARROWS);
    while !left.is_empty() {
        let leads_nowhere = |row: &(&&str, &&[&str])| row.1.iter().all(|to| !left.contains_key(to));
        let Some(done) = left.iter().find(leads_nowhere).map(|row| *row.0) else {
            panic!("a circle among {:?}", left.keys());
        };
        left.remove(done);
    }
}

#[test]
fn the_table_of_arrows_is_as_strict_as_the_code() {
    let mut drawn: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for source in sources() {
        if let Some(module) = source.module.first() {
            let arrows = arrows(&source.module, &source.text);
            drawn.entry(module.clone()).or_default().extend(arrows);
        }
    }
    let mut idle = Vec::new();
    for (module, allowed) in ARROWS {
        let drawn = drawn.get(module).cloned().unwrap_or_default();
        let idle_here = allowed.iter().filter(|to| !drawn.contains(**to));
        idle.extend(idle_here.map(|to| format!("{module} -> {to} is allowed and not there")));
    }
    assert!(idle.is_empty(), "{idle:#?}");
}

/// The modules, and where what a folder's `mod.rs` takes from a file in it stands: by the folder and the name.
struct Modules {
    all: BTreeSet<Vec<String>>,
    taken: BTreeMap<(Vec<String>, String), Vec<String>>,
}

impl Modules {
    fn of(sources: &[Source]) -> Self {
        let all = sources.iter().map(|one| one.module.clone()).collect();
        let mut modules = Self {
            all,
            taken: BTreeMap::new(),
        };
        for source in sources {
            for path in paths(&source.text) {
                let (at, name) = (file_of(&source.module, &path, &modules), path.last());
                if let (Some(at), Some(name)) = (at, name)
                    && at.len() > source.module.len()
                    && at.starts_with(&source.module)
                {
                    let key = (source.module.clone(), name.clone());
                    modules.taken.insert(key, at);
                }
            }
        }
        modules
    }
}

/// The file of the crate that `path`, as it stands in `module`, leads into: the deepest module on it, or the one from which that
/// has the name.
fn file_of(module: &[String], path: &[String], modules: &Modules) -> Option<Vec<String>> {
    let (mut at, rest) = match path.first().map(String::as_str) {
        Some("crate") => (Vec::new(), &path[1..]),
        Some("super" | "self") => {
            let ups = path.iter().take_while(|name| *name == "super").count();
            let here = module.len().checked_sub(ups)?;
            (module[..here].to_vec(), &path[ups.max(1)..])
        }
        // `child::name`, in the file that declares the child.
        _ => (module.to_vec(), path),
    };
    let start = at.len();
    for name in rest {
        at.push(name.clone());
        if !modules.all.contains(&at) {
            at.pop();
            if let Some(taken) = modules.taken.get(&(at.clone(), name.clone())) {
                return Some(taken.clone());
            }
            break;
        }
    }
    (at.len() > start || path[0] == "super").then_some(at)
}

/// A module and one that it names.
type Named = (Vec<String>, Vec<String>);

/// What the modules of `sources` name, as far as it `counts`.
fn named<'a>(
    modules: &Modules,
    sources: impl Iterator<Item = &'a Source>,
    counts: impl Fn(Named) -> Option<Named>,
) -> BTreeSet<Named> {
    let mut named = BTreeSet::new();
    for source in sources {
        for path in paths(&source.text) {
            let to = file_of(&source.module, &path, modules);
            named.extend(to.and_then(|to| counts((source.module.clone(), to))));
        }
    }
    named
}

/// Those pairs of which each names the other.
fn both_ways(named: &BTreeSet<Named>) -> Vec<String> {
    let both = named
        .iter()
        .filter(|(a, b)| a < b && named.contains(&(b.clone(), a.clone())));
    both.map(|(a, b)| format!("{} and {}", a.join("/"), b.join("/")))
        .collect()
}

/// Pairs of files of one module of which each names the other; not what a folder's `mod.rs` has to do with the files
/// in it.
fn mutual(sources: &[Source]) -> Vec<String> {
    let of_one = |(a, b): Named| {
        let alike = !a.is_empty() && a.first() == b.first();
        let apart = !a.starts_with(&b) && !b.starts_with(&a);
        (alike && apart).then_some((a, b))
    };
    both_ways(&named(&Modules::of(sources), sources.iter(), of_one))
}

/// Folders of one module, and files beside them, of which each names something in the other.
fn mutual_folders(sources: &[Source]) -> Vec<String> {
    let of_tests = |source: &&Source| {
        let last = source.module.last().map(String::as_str);
        matches!(last, Some("tests" | "fixture"))
    };
    let product = sources.iter().filter(|source| !of_tests(source));
    let second_level = |(a, b): Named| {
        let is_within = a.len() > 1 && b.len() > 1 && a[0] == b[0];
        is_within.then(|| (a[..2].to_vec(), b[..2].to_vec()))
    };
    both_ways(&named(&Modules::of(sources), product, second_level))
}

#[test]
fn no_two_folders_of_one_module_import_each_other() {
    let mutual = mutual_folders(&sources());
    assert!(mutual.is_empty(), "{mutual:#?}");
}

#[test]
fn no_two_files_of_one_module_import_each_other() {
    let mutual = mutual(&sources());
    assert!(mutual.is_empty(), "{mutual:#?}");
}

#[test]
fn a_level_is_decided_without_the_law_and_the_law_fitted_without_a_level() {
    let allowed = BTreeMap::from(ARROWS);
    let alert = allowed["alert"];
    assert!(!alert.contains(&"model") && !alert.contains(&"fit"));
    for science in ["regime", "model", "fit", "forecast"] {
        assert!(!allowed[science].contains(&"alert"), "{science}");
    }
}

#[test]
fn the_core_is_pure() {
    let mut wrong = Vec::new();
    for source in sources() {
        let is_pure = |module: &String| PURE.contains(&module.as_str());
        if source.module.first().is_some_and(is_pure) {
            for what in impurities(&source.text) {
                wrong.push(format!("{}: {what}", source.file.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// The types that `text` defines, outside functions and other items.
fn types(text: &str) -> impl Iterator<Item = &str> {
    let kinds = ["struct ", "enum ", "trait ", "type ", "union "];
    text.lines().filter_map(move |line| {
        let shown = line
            .strip_prefix("pub(")
            .and_then(|rest| rest.split_once(") "));
        let line = shown.map_or(line, |(_, item)| item);
        let line = line.strip_prefix("pub ").unwrap_or(line);
        let named = kinds.iter().find_map(|kind| line.strip_prefix(kind))?;
        let end = named.find(|c: char| !(c.is_alphanumeric() || c == '_'));
        Some(&named[..end.unwrap_or(named.len())])
    })
}

#[test]
fn a_name_of_a_type_stands_once() {
    let sources = sources();
    let mut places: BTreeMap<&str, Vec<String>> = BTreeMap::new();
    for source in &sources {
        for name in types(&source.text) {
            let file = source.file.display().to_string();
            places.entry(name).or_default().push(file);
        }
    }
    places.retain(|name, files| files.len() > 1 && !NAMED_TWICE.contains(name));
    assert!(places.is_empty(), "{places:#?}");
}

/// The functions that `text` defines, and how many arguments each takes, the members of a tuple counted each.
fn functions(text: &str) -> Vec<(String, usize)> {
    let tokens = tokens(text);
    let mut found = Vec::new();
    for at in 0..tokens.len() {
        // `fn` without a name is a type.
        if tokens[at] == "fn" && tokens.get(at + 1).is_some_and(|name| is_name(name)) {
            found.push((tokens[at + 1].clone(), arguments(&tokens[at + 2..])));
        }
    }
    found
}

/// Counts the arguments of a definition from behind its name on.
fn arguments(tokens: &[String]) -> usize {
    let mut angles = 0_usize;
    let mut start = 0;
    while tokens[start] != "(" || angles > 0 {
        match tokens[start].as_str() {
            "<" => angles += 1,
            ">" if tokens[start - 1] != "-" => angles -= 1,
            _ => {}
        }
        start += 1;
    }
    // Open brackets, and whether each stands where an argument's pattern or type is a tuple.
    let (mut open, mut count, mut is_begun) = (vec![true], 0, false);
    for (before, token) in tokens[start..].iter().zip(&tokens[start + 1..]) {
        let is_counted = open.iter().all(|is_counted| *is_counted);
        match token.as_str() {
            "(" => open.push(is_counted && ["(", ","].contains(&before.as_str())),
            "[" | "{" | "<" => open.push(false),
            ">" if ["-", "="].contains(&before.as_str()) => {}
            ")" | "]" | "}" | ">" => {
                open.pop();
                if open.is_empty() {
                    return count + usize::from(is_begun);
                }
            }
            "," if is_counted => {
                count += usize::from(is_begun);
                is_begun = false;
                continue;
            }
            _ => {}
        }
        is_begun |= is_counted;
    }
    count
}

#[test]
fn no_function_takes_more_arguments_by_putting_them_into_tuples() {
    let mut wrong = Vec::new();
    for source in sources() {
        for (name, count) in functions(&source.text) {
            if count > MOST_ARGUMENTS {
                wrong.push(format!("{}: {name}, {count}", source.file.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn every_file_is_short_and_says_its_job_in_its_first_line() {
    let mut wrong = Vec::new();
    for source in sources() {
        let lines = source.text.lines().count();
        if lines > LONGEST_FILE {
            wrong.push(format!("{}: {lines} lines", source.file.display()));
        }
        if !source.text.starts_with("//! ") {
            wrong.push(format!("{}: no job", source.file.display()));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// The wheel is built with `--locked` and has a lock file of its own, which `cargo` does not change when a dependency is added here.
#[test]
fn the_lock_file_of_the_wheel_names_the_dependencies_of_the_product() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let read = |path: &str| -> toml::Table {
        std::fs::read_to_string(root.join(path))
            .unwrap()
            .parse()
            .unwrap()
    };
    let manifest = read("Cargo.toml");
    let named = |table: &toml::Table| -> Vec<String> {
        let dependencies = table.get("dependencies").and_then(toml::Value::as_table);
        let optional = |value: &toml::Value| {
            value.get("optional").and_then(toml::Value::as_bool) == Some(true)
        };
        let name = |(key, value): (&String, &toml::Value)| match value.get("package") {
            Some(package) => package.as_str().unwrap().to_owned(),
            None => key.clone(),
        };
        dependencies
            .into_iter()
            .flatten()
            .filter(|(_, value)| !optional(value))
            .map(name)
            .collect()
    };
    let mut asked: BTreeSet<String> = named(&manifest).into_iter().collect();
    let targets = manifest.get("target").and_then(toml::Value::as_table);
    for target in targets
        .into_iter()
        .flatten()
        .filter_map(|(_, value)| value.as_table())
    {
        asked.extend(named(target));
    }
    let lock = read("python/Cargo.lock");
    let mut packages = lock["package"].as_array().unwrap().iter();
    let product = packages
        .find(|package| package["name"].as_str() == Some("slipwatch"))
        .unwrap();
    // A package that is there in two versions stands as its name and version.
    let name = |value: &toml::Value| {
        value
            .as_str()
            .unwrap()
            .split(' ')
            .next()
            .unwrap()
            .to_owned()
    };
    let locked: BTreeSet<String> = product["dependencies"]
        .as_array()
        .unwrap()
        .iter()
        .map(name)
        .collect();
    assert_eq!(
        locked, asked,
        "run `cargo metadata` in python/ and commit its Cargo.lock"
    );
}

mod the_reader_of_sources {
    use super::*;

    fn module(path: &str) -> Vec<String> {
        path.split("::").map(str::to_owned).collect()
    }

    fn found(path: &str, text: &str) -> Vec<String> {
        arrows(&module(path), text).into_iter().collect()
    }

    #[test]
    fn sees_every_way_to_name_a_module() {
        assert_eq!(found("alert", "use crate::model::Law;"), ["model"]);
        assert_eq!(found("alert", "let x = crate::fit::solve(1);"), ["fit"]);
        let nested = "use crate::{fit::{Rate, Rates}, model as law, reading::*};";
        assert_eq!(found("alert", nested), ["fit", "model", "reading"]);
        assert_eq!(found("alert", "pub use super::fit::Rate;"), ["fit"]);
        assert_eq!(found("alert::policy", "super::super::fit::f()"), ["fit"]);
        assert_eq!(found("alert", "use super::{fit, model};"), ["fit", "model"]);
        assert_eq!(found("alert", "Vec::<crate::fit::Rate>::new()"), ["fit"]);
    }

    #[test]
    fn sees_none_where_there_is_none() {
        let innocent = [
            "use super::policy::Level;",
            "use crate::alert::Level;",
            "// use crate::fit::Rate;",
            "/* crate::fit */ fn f<'a>(x: &'a str) {}",
            "let s = \"crate::fit\\\" crate::fit\"; let q = '\"';",
            "let s = r#\"crate::fit \" crate::fit\"#;",
            "let fit = fit::rate();",
        ];
        for text in innocent {
            assert!(found("alert::policy", text).is_empty(), "{text}");
        }
        assert_eq!(found("alert", "let q = '\"'; crate::fit::f(\"\")"), ["fit"]);
    }

    #[test]
    fn sees_two_files_that_import_each_other_and_not_a_folder_and_its_files() {
        let source = |name: &str, text: &str| Source {
            file: PathBuf::from(name),
            module: module(name),
            text: text.to_owned(),
        };
        let hook = source("runtime::hook", "use super::webhook;");
        let webhook = source("runtime::webhook", "use super::hook::{Alert, state_name};");
        let folder = source("runtime", "mod hook; pub use hook::Alert;");
        assert_eq!(
            mutual(&[folder, hook, webhook]),
            ["runtime/hook and runtime/webhook"]
        );
        let hook = source("runtime::hook", "use super::Progress;");
        let webhook = source("runtime::webhook", "use crate::runtime::hook::Alert;");
        let folder = source("runtime", "pub use hook::Alert;");
        assert!(mutual(&[folder, hook, webhook]).is_empty());
    }

    #[test]
    fn sees_the_clock_the_files_and_ambient_randomness() {
        for text in [
            "use std::fs::File;",
            "use std::{fmt, fs};",
            "use std::{io, time::{Duration, Instant}};",
            "use std::time; fn f() { time::SystemTime::now(); }",
            "tokio::time::sleep(d)",
            "std::env::var(\"DBG\")",
            "rand::rngs::OsRng",
            "Pcg::from_os_rng()",
        ] {
            assert!(!impurities(text).is_empty(), "{text}");
        }
        let clean = "use std::time::Duration; use std::{fmt, collections::BTreeMap};";
        assert!(impurities(clean).is_empty());
    }

    #[test]
    fn sees_the_types_that_a_file_defines() {
        let text = "pub struct A {\npub(super) enum B<T> {\npub(in crate::runtime) type C = u8;\ntrait D: E {}\n    \
                    type Output = u8;\nfn f() {}\n";
        assert_eq!(types(text).collect::<Vec<_>>(), ["A", "B", "C", "D"]);
    }

    #[test]
    fn counts_the_members_of_tuples_among_the_arguments() {
        let count = |text: &str| functions(text)[0].1;
        assert_eq!(count("fn f() -> (u8, u8) { g(1, 2) }"), 0);
        assert_eq!(count("fn f(&self, a: Vec<(u8, u8)>,) {}"), 2);
        assert_eq!(
            count("fn f<F: Fn(u8, u8)>((a, b): (u8, u8), c: [u8; 2]) {}"),
            3
        );
        assert_eq!(
            count("fn f(each: impl Fn(u8, u8) -> u8, c: &dyn Fn(u8, u8)) {}"),
            2
        );
    }

    #[test]
    fn leaves_out_the_tests_and_nothing_else() {
        let text = "#[cfg(test)]\nuse a;\nfn f() {}\n#[cfg(test)]\nmod tests {}\n";
        assert_eq!(without_tests(text), "#[cfg(test)]\nuse a;\nfn f() {}\n");
        let elsewhere = "#[cfg(test)]\nmod fixture;\nmod b;\nfn f() {}\n";
        assert_eq!(without_tests(elsewhere), elsewhere);
        assert_eq!(module_of(Path::new("fit/rates.rs")), ["fit", "rates"]);
        assert_eq!(module_of(Path::new("fit/mod.rs")), ["fit"]);
        assert!(module_of(Path::new("lib.rs")).is_empty());
    }
}
