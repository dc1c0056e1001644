//! `man DIR`: the manual, a page for each command, and one for the config.

mod examples;

use anyhow::Context;
use clap::CommandFactory;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::{fs, io};

/// Write the manual pages into a folder: one for each command, and slipwatch-config(5)
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The folder, created when missing
    #[arg(value_name = "DIR")]
    folder: PathBuf,
}

/// The config with every key, as it is tested.
const CONFIG: &str = include_str!("../../config/example.toml");
const CONFIG_PAGE: &str = "slipwatch-config.5";
const CONFIG_HEAD: &str = "\
.TH slipwatch-config 5
.SH NAME
slipwatch-config \\- the file that describes a site
.SH DESCRIPTION
A site is one TOML file. slipwatch init writes it from files as the logger writes them, slipwatch check says everything
that is wrong with it, and slipwatch run takes it. Unknown keys are refused. Below is a site with every key; a line that
begins with # shows what may be added.
";
const CONFIG_END: &str = "\
.SH SEE ALSO
.BR slipwatch\\-init (1),
.BR slipwatch\\-check (1),
.BR slipwatch\\-run (1)
";
const EXIT_STATUS: [(&str, &str); 7] = [
    ("0", "done"),
    ("1", "the job found trouble"),
    ("2", "invalid command line"),
    ("65", "the data are bad"),
    ("69", "a service is missing"),
    ("74", "input or output failed"),
    ("78", "the config is wrong"),
];

/// Writes them.
pub(super) fn run(args: &Args) -> anyhow::Result<()> {
    let folder = &args.folder;
    write(folder).with_context(|| format!("cannot write the manual to {}", folder.display()))
}

fn write(folder: &Path) -> io::Result<()> {
    fs::create_dir_all(folder)?;
    clap_mangen::generate_to(super::Cli::command(), folder)?;
    for (command, examples) in examples::ALL {
        let page = folder.join(page(command));
        let text = fs::read_to_string(&page)?;
        fs::write(&page, text + &sections(examples))?;
    }
    let config = format!(
        "{CONFIG_HEAD}{}{CONFIG_END}",
        literal("EXAMPLES", CONFIG.lines())
    );
    fs::write(folder.join(CONFIG_PAGE), config)
}

/// The file of the page of a command, whose words are parted by blanks.
fn page(command: &str) -> String {
    let words = std::iter::once("slipwatch").chain(command.split_whitespace());
    words.collect::<Vec<_>>().join("-") + ".1"
}

fn sections(examples: &[&str]) -> String {
    let mut text = literal("EXAMPLES", examples.iter().copied());
    text.push_str(".SH EXIT STATUS\n");
    for (code, meaning) in EXIT_STATUS {
        // Writing to a string cannot fail.
        let _ = writeln!(text, ".TP\n{code}\n{meaning}");
    }
    text
}

/// A section whose lines stand as they are.
fn literal<'a>(name: &str, lines: impl Iterator<Item = &'a str>) -> String {
    let mut text = format!(".SH {name}\n.nf\n");
    for line in lines {
        let line = line.replace('\\', "\\e").replace('-', "\\-");
        // A dot or an apostrophe at its beginning would be a command.
        let _ = writeln!(text, "\\&{line}");
    }
    text + ".fi\n"
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    /// The words of a line as a shell parts them, as far as double quotes go.
    fn words(line: &str) -> Vec<String> {
        let mut words = vec![String::new()];
        let mut is_quoted = false;
        for letter in line.chars() {
            match letter {
                '"' => is_quoted = !is_quoted,
                ' ' if !is_quoted => words.push(String::new()),
                other => words.last_mut().unwrap().push(other),
            }
        }
        words
    }

    #[test]
    fn every_command_has_examples_and_each_can_be_parsed() {
        let folder = tempfile::tempdir().unwrap();
        write(folder.path()).unwrap();
        for entry in fs::read_dir(folder.path()).unwrap() {
            let entry = entry.unwrap();
            let name = entry.file_name().into_string().unwrap();
            let text = fs::read_to_string(entry.path()).unwrap();
            assert_eq!(text.matches(".SH EXAMPLES").count(), 1, "{name}");
            if name != CONFIG_PAGE {
                assert!(text.contains(".SH EXIT STATUS"), "{name}");
            }
        }
        for (command, examples) in examples::ALL {
            for line in examples {
                let ours = line.rsplit("| ").next().unwrap();
                let ours = ours.split(" < ").next().unwrap();
                assert!(ours.starts_with(&format!("slipwatch {command}")), "{line}");
                let parsed = super::super::Cli::try_parse_from(words(ours));
                assert!(parsed.is_ok(), "{line}: {}", parsed.unwrap_err());
            }
        }
    }
}
