//! The figures in the README are those that the studies wrote into docs/.

use std::fs;
use std::path::Path;

fn read(file: &str) -> String {
    fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(file)).unwrap()
}

/// The cell of that number, from 1, of the first row that begins so, below the first line that begins with `under`.
fn cell(file: &str, under: &str, row: &str, number: usize) -> String {
    let text = read(file);
    let mut lines = text.lines().skip_while(|line| !line.starts_with(under));
    let line = lines.find(|line| line.starts_with(row));
    let line = line.unwrap_or_else(|| panic!("{file}: no row {row:?} under {under:?}"));
    let cell = line.split('|').nth(number).unwrap();
    cell.replace('*', "").trim().to_owned()
}

/// As the README writes it: without the zero before the point.
fn short(figure: &str) -> String {
    figure
        .split(", ")
        .map(|one| one.strip_prefix('0').unwrap_or(one))
        .collect::<Vec<_>>()
        .join(", ")
}

fn in_readme(row: &str) -> String {
    cell("README.md", "## What its forecasts are worth", row, 3)
}

#[test]
fn what_the_readme_says_of_forecasts_is_what_the_studies_found() {
    let measured = |row: &str| {
        let under = "### Measured failures, each place once";
        short(&cell("docs/skill.md", under, row, 5))
    };
    let panel = measured("| panel ");
    let (mean, geometric) = panel.split_once(", ").unwrap();
    assert_eq!(in_readme("| 3 measured failures "), mean);
    assert_eq!(
        in_readme("| the same | the same with geometric "),
        geometric
    );

    let alarms = "docs/false-alarms.md";
    let by_chance = "## What another `red_chance` gives";
    assert_eq!(
        in_readme("| the same 8 kinds, other slopes"),
        cell(alarms, by_chance, "| 0.27 ", 2)
    );
    let reds = |under: &str, row: &str| short(&cell(alarms, under, row, 3));
    let [daily, hourly, rain] = [
        ("## Read each 1 d", "| all "),
        ("## Read each 1 h", "| all "),
        ("## Read each 1 h", "| Rain "),
    ]
    .map(|(under, row)| reds(under, row));
    assert_eq!(
        in_readme("| simulated slopes that stood "),
        format!("{daily}, {hourly}; {rain}")
    );

    let creep = |number: usize| cell("docs/steady-creep.md", "# Steady creep", "| all ", number);
    assert_eq!(in_readme("| 300 simulated slopes of one rate "), creep(4));
    assert_eq!(
        in_readme("| 300 whose rate doubles "),
        format!("{}; {}", creep(6), creep(8))
    );
}
