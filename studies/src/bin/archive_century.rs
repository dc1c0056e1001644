//! Makes the Century Mine recordings from the folder of their CSV files:
//! `archive_century CSV_FOLDER OUTPUT_FOLDER`.

use anyhow::{Context, Result};
use slipwatch::reading::Recording;
use slipwatch::runtime::ingest::{ReadOptions, read_files, write_mcap};
use std::path::Path;

const ATTRIBUTION: &str = "T. de Wit, Zenodo 10.5281/zenodo.15003054, CC BY 4.0; de Wit & Snieder, Seismica 5(1), 2026; rain: Bureau of Meteorology";

/// Prisms of the 2013 files, a file each.
const WEST_WALL: [&str; 3] = ["31-1930", "31-1931", "40-1938"];

fn main() -> Result<()> {
    let mut arguments = std::env::args_os().skip(1);
    let (Some(source), Some(target)) = (arguments.next(), arguments.next()) else {
        anyhow::bail!("usage: archive_century CSV_FOLDER OUTPUT_FOLDER");
    };
    let (source, target) = (Path::new(&source), Path::new(&target));
    let archive = |recording: Recording, name: &str| {
        write_mcap(&recording, &target.join(name)).with_context(|| format!("writing {name}"))
    };
    archive(west_wall(source)?, "century-mine-2013.mcap")?;
    archive(south_west(source)?, "century-mine-2014-southwest.mcap")
}

fn west_wall(source: &Path) -> Result<Recording> {
    let mut parts = vec![read(
        source,
        "century_2013_rain.csv",
        &ReadOptions::default(),
    )?];
    for prism in WEST_WALL {
        let map = format!("displacement_mm={prism}:displacement:mm").parse()?;
        let options = ReadOptions {
            columns: vec![map],
            ..ReadOptions::default()
        };
        parts.push(read(
            source,
            &format!("century_2013_{prism}.csv"),
            &options,
        )?);
    }
    let (mut recording, _) = Recording::merge(parts)?;
    describe(
        &mut recording,
        "Century Mine, west wall, Queensland: three prisms and daily rain, 2013-2014",
        "rain_mm is that of the 24 h to 09:00 at station 029167, with none for 2013-12-29; prism 40-1938 stands in the south-west recording with another zero",
    );
    Ok(recording)
}

fn south_west(source: &Path) -> Result<Recording> {
    let options = ReadOptions::default();
    let mut recording = read(source, "century_2014_southwest.csv", &options)?;
    describe(
        &mut recording,
        "Century Mine, south-west, Queensland: eleven prisms, 2014",
        "the source states no time of day: noon, UTC+10:00, is assumed; prism 40-1938 stands in the 2013 recording with another zero, so the two must not be joined",
    );
    Ok(recording)
}

fn read(source: &Path, name: &str, options: &ReadOptions) -> Result<Recording> {
    let (recording, disorder) = read_files(&[source.join(name)], options)?;
    anyhow::ensure!(
        disorder == slipwatch::reading::Disorder::default(),
        "{name}: found {disorder:?}, expected rows in order"
    );
    Ok(recording)
}

fn describe(recording: &mut Recording, title: &str, notes: &str) {
    let entries = [
        ("title", title),
        ("attribution", ATTRIBUTION),
        ("licence", "CC BY 4.0"),
        ("kind", "measured"),
        (
            "changes",
            "gathered from CSV files into MCAP, times in UTC, values as in those files",
        ),
        ("notes", notes),
    ];
    recording.provenance = entries
        .map(|(key, text)| (key.to_owned(), text.to_owned()))
        .into();
}
