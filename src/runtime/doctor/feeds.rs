//! Whether the readings can be had: the files' folders and files, as this user; the brokers.

use super::{CheckVerdict, Finding};
use crate::config::{Broker, Config, FileSource};
use crate::runtime::mqtt;
use crate::runtime::tail::{Decoder, list};
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;
use std::time::Duration;

/// A broker that takes longer to answer is not there.
const ANSWER: Duration = Duration::from_secs(10);
const SOURCE: &str = "source";

/// One finding for each source.
pub(super) fn findings(config: &Config) -> Vec<Finding> {
    let files = config.sources.iter().map(|source| {
        let decoder = Decoder::new(source, &config.benchmarks);
        files(source, &decoder)
    });
    files.chain(config.brokers.iter().map(broker)).collect()
}

fn files(source: &FileSource, decoder: &Decoder) -> Finding {
    let finding =
        |verdict, text: String| Finding::new(SOURCE, verdict, format!("{:?}: {text}", source.id));
    let pattern = &source.pattern;
    let folder = pattern.folder().display();
    let listed = match list(pattern, decoder) {
        Ok((listed, _)) => listed,
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            let text = format!("there is no folder {folder}; create it, or put the path right");
            return finding(CheckVerdict::Doubtful, text);
        }
        Err(error) => {
            let text = format!("{folder} cannot be listed as this user: {error}");
            return finding(CheckVerdict::Wrong, text);
        }
    };
    let failed = listed
        .iter()
        .find_map(|(file, _)| Some((file, open(file).err()?)));
    match (failed, listed.len()) {
        (Some((file, error)), _) => {
            let text = format!("{} cannot be read as this user: {error}", file.display());
            finding(CheckVerdict::Wrong, text)
        }
        (None, 0) => finding(
            CheckVerdict::Doubtful,
            format!("there is no file {pattern} yet"),
        ),
        (None, count) => finding(
            CheckVerdict::Good,
            format!("files that can be read: {count}"),
        ),
    }
}

fn open(file: &Path) -> io::Result<()> {
    File::open(file)?.read(&mut [0; 1]).map(|_| ())
}

fn broker(broker: &Broker) -> Finding {
    let asked = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .map_err(|error| format!("could not be asked: {error}"))
        .and_then(|runtime| {
            let answer = async { tokio::time::timeout(ANSWER, mqtt::try_out(broker)).await };
            let none = |_| Err(format!("did not answer within {} s", ANSWER.as_secs()));
            let answer = runtime.block_on(answer).unwrap_or_else(none);
            // A search of its name may still be under way.
            runtime.shutdown_background();
            answer
        });
    let (verdict, text) = match asked {
        Ok(()) => (CheckVerdict::Good, "takes the subscription".to_owned()),
        Err(why) => (CheckVerdict::Wrong, why),
    };
    let address = &broker.address;
    let text = format!("{:?}: the broker {address:?} {text}", broker.id);
    Finding::new(SOURCE, verdict, text)
}
