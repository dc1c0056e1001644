//! Explains measured series with nothing declared and writes docs/closing-the-loop.md with its figures: `loop`.
//!
//! Every number in the document is measured by the run that writes it. Where a measured series may be read but not
//! redistributed and is not at hand, its section is left out and the run says so.
#![expect(
    clippy::print_stderr,
    reason = "what is left out is reported to the user"
)]

mod document;
mod found_again;
mod injected;
mod put_in;
mod subjects;
mod tables;
#[cfg(test)]
mod tests;

use anyhow::{Context, Result};
use document::ExplainedSubject;
use slipwatch::figures::pictures;
use subjects::{SUBJECTS, Subject};

fn main() -> Result<()> {
    let docs = studies::project().join("docs");
    let folder = docs.join("loop");
    std::fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
    let mut explained = Vec::new();
    for subject in &SUBJECTS {
        let Some(explanation) = subject.explained()? else {
            eprintln!("left out: {} (no measured data)", subject.heading);
            continue;
        };
        let mut figures = Vec::new();
        for picture in pictures(&subject.drawn(&explanation)) {
            if !subject.figures.contains(&picture.name) {
                continue;
            }
            let name = format!("{}-{}.svg", subject.name, picture.name);
            let file = folder.join(&name);
            std::fs::write(&file, &picture.svg).with_context(|| file.display().to_string())?;
            figures.push((name, picture.caption));
        }
        let subject: &Subject = subject;
        explained.push(ExplainedSubject {
            subject,
            explanation,
            figures,
        });
    }
    let put_in = injected::section(&injected::all()?);
    let file = docs.join("closing-the-loop.md");
    std::fs::write(&file, document::text(&explained) + &put_in)
        .with_context(|| file.display().to_string())
}
