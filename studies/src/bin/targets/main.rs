//! What was asked of slipwatch and what it reaches, in one list.
//!
//! ```text
//! cargo run --release -p studies --bin targets           what is not reached
//! cargo run --release -p studies --bin targets -- --all  and what is
//! ```
//!
//! The figures are those that the studies wrote into docs/, read where they stand: `targets.json` says in which row of which
//! document, and what was asked. Beside them are the rows of docs/skill.md that state a target themselves, and the tests that are
//! ignored because what they assert is not reached.

use clap::Parser;
use serde::Deserialize;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use studies::project;

/// What was asked and what is reached.
#[derive(Debug, Parser)]
struct TargetArguments {
    /// Those that are reached too.
    #[arg(long)]
    all: bool,
}

/// A figure that stands in a document, and its bound.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct Target {
    /// What was asked, for people.
    asked: String,
    /// The document.
    file: String,
    /// How the line begins below which its row is the first.
    under: String,
    /// How the row begins.
    row: String,
    /// The cell, from 1; 0: the whole line.
    cell: usize,
    /// Which number in the cell, from 1.
    #[serde(default = "first")]
    nth: usize,
    least: Option<f64>,
    most: Option<f64>,
}

/// One line of the list.
#[derive(Debug, Clone, PartialEq)]
struct TargetRow {
    asked: String,
    is_met: bool,
    figure: String,
    stands_in: String,
}

fn first() -> usize {
    1
}

fn main() -> anyhow::Result<()> {
    let asked = TargetArguments::parse();
    let mut rows = of_documents()?;
    rows.extend(stated_in_skill()?);
    rows.extend(ignored_tests(&project().join("tests"))?);
    rows.extend(ignored_tests(&project().join("studies/src"))?);
    let unmet = rows.iter().filter(|row| !row.is_met).count();
    let mut out = String::from("| asked |  | figure | stands in |\n|---|---|---|---|\n");
    for row in rows.iter().filter(|row| asked.all || !row.is_met) {
        let met = if row.is_met { "met" } else { "**not met**" };
        let (asked, figure, place) = (&row.asked, &row.figure, &row.stands_in);
        let _ = writeln!(out, "| {asked} | {met} | {figure} | {place} |");
    }
    let _ = writeln!(out, "\n{unmet} of {} not met.", rows.len());
    std::io::stdout().write_all(out.as_bytes())?;
    Ok(())
}

/// The figures that `targets.json` names.
fn of_documents() -> anyhow::Result<Vec<TargetRow>> {
    let targets: Vec<Target> = serde_json::from_str(include_str!("targets.json"))?;
    let row = |target: &Target| {
        let text = std::fs::read_to_string(project().join(&target.file))?;
        let figure = target.figure(&text).ok_or_else(|| {
            anyhow::anyhow!(
                "{}: no figure for \"{}\" below \"{}\" in the row \"{}\"",
                target.file,
                target.asked,
                target.under,
                target.row
            )
        })?;
        Ok(TargetRow {
            asked: target.asked.clone(),
            is_met: target.least.is_none_or(|least| figure >= least)
                && target.most.is_none_or(|most| figure <= most),
            figure: figure.to_string(),
            stands_in: target.file.clone(),
        })
    };
    targets.iter().map(row).collect()
}

impl Target {
    fn figure(&self, text: &str) -> Option<f64> {
        let mut lines = text.lines();
        lines.find(|line| line.starts_with(&self.under))?;
        let row = lines.find(|line| line.starts_with(&self.row))?;
        let cell = match self.cell {
            0 => row,
            cell => row.split('|').nth(cell)?,
        };
        numbers(cell).nth(self.nth - 1)
    }
}

/// The numbers in a text, in their order.
fn numbers(text: &str) -> impl Iterator<Item = f64> {
    let parts = text.split(|c: char| !(c.is_ascii_digit() || c == '.'));
    parts.filter_map(|part| part.trim_matches('.').parse().ok())
}

/// The targets that docs/skill.md states beside their figures.
fn stated_in_skill() -> anyhow::Result<Vec<TargetRow>> {
    let file = "docs/skill.md";
    let text = std::fs::read_to_string(project().join(file))?;
    let row = |line: &str| {
        let cells: Vec<&str> = line.split('|').map(str::trim).collect();
        let [_, asked, met, figure, _] = cells[..] else {
            return None;
        };
        ["met", "**not met**"].contains(&met).then(|| TargetRow {
            asked: asked.to_owned(),
            is_met: met == "met",
            figure: figure.to_owned(),
            stands_in: file.to_owned(),
        })
    };
    Ok(text.lines().filter_map(row).collect())
}

/// Tests below a folder that are ignored because what they assert is not reached.
fn ignored_tests(folder: &Path) -> anyhow::Result<Vec<TargetRow>> {
    let mut rows = Vec::new();
    for file in sources(folder)? {
        let text = std::fs::read_to_string(&file)?;
        let mut lines = text.lines();
        while let Some(line) = lines.next() {
            let reason = line
                .trim()
                .strip_prefix("#[ignore = \"not reached")
                .and_then(|rest| rest.strip_suffix("\"]"));
            let Some(reason) = reason else { continue };
            let name = lines.find_map(|line| line.split_once("fn "));
            let name = name.and_then(|(_, rest)| rest.split('(').next());
            rows.push(TargetRow {
                asked: name.unwrap_or_default().replace('_', " "),
                is_met: false,
                figure: reason.trim_start_matches([':', ' ']).to_owned(),
                stands_in: file
                    .strip_prefix(project())
                    .unwrap_or(&file)
                    .display()
                    .to_string(),
            });
        }
    }
    Ok(rows)
}

/// Every source file below a folder, by name.
fn sources(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            files.extend(sources(&path)?);
        } else if path.extension().is_some_and(|ext| ext == "rs") {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_target_finds_its_figure_in_the_document_it_names() {
        let rows = of_documents().unwrap();
        assert!(rows.len() > 20, "{}", rows.len());
    }

    #[test]
    fn a_target_is_met_by_its_bound_and_not_by_another_row() {
        let target = Target {
            asked: String::new(),
            file: String::new(),
            under: "## b".to_owned(),
            row: "| all".to_owned(),
            cell: 2,
            nth: 2,
            least: None,
            most: None,
        };
        let text = "## a\n| all | 1 of 2 |\n## b\n| one | 3 of 4 |\n| all | 5.5 of 6 (7 %). |\n";
        assert_eq!(target.figure(text), Some(6.0));
        let other = Target { nth: 4, ..target };
        assert_eq!(other.figure(text), None);
    }

    #[test]
    fn ignored_tests_are_listed_with_what_they_do_not_reach() {
        let rows = ignored_tests(&project().join("tests")).unwrap();
        assert!(!rows.is_empty());
        assert!(
            rows.iter()
                .all(|row| !row.asked.is_empty() && !row.figure.is_empty())
        );
    }
}
