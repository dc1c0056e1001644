//! How drills stand, on the page.

use super::{Value, open_on};
use crate::site::Site;
use jiff::SignedDuration;
use std::fmt::Write as _;

/// A benchmark that creeps.
fn readings() -> String {
    let newest = slipwatch::runtime::clock::now();
    let mut text = String::from("time,p_displacement_mm\n");
    for hour in (1..49).rev() {
        let time = newest - SignedDuration::from_hours(hour);
        let mm = 0.01 * (48 - hour) as f64;
        writeln!(text, "{time},{mm}").unwrap();
    }
    text
}

fn config(port: u16) -> String {
    format!(
        "[site]\nname = \"Drilled\"\nstate_dir = \"state\"\nlisten = \"127.0.0.1:{port}\"\ntoken_file = \"token\"\n\
         [[source]]\nid = \"logger\"\nkind = \"csv\"\npath = \"slope.csv\"\n\
         [[hook]]\nrun = [\"/bin/true\"]\ndrills = true\n[drill]\nevery = \"1h\"\n"
    )
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "Chromium was not found by build.rs")]
fn the_site_page_shows_when_the_last_drill_passed_and_how_long_it_took() {
    let (site, mut browser) = open_on(|| Site::of(&readings(), config), "");
    let drills = "document.querySelector('section[aria-label=Drills]')";
    browser.until(&format!(
        "{drills}?.innerText.includes('1 passed and 0 failed')"
    ));
    let drill = &site.json("/api/status")["drill"];
    let seconds = drill["latency_seconds"].as_f64().unwrap();
    let text = browser.value(&format!("{drills}.innerText"));
    let Value::String(text) = text else {
        panic!("{text}")
    };
    let shown = text.split("The last that passed: ").nth(1);
    let shown = shown.and_then(|rest| rest.split(' ').next()).unwrap();
    let shown: f64 = shown.parse().unwrap();
    assert!((shown - seconds).abs() <= 0.01 * seconds, "{shown} {drill}");
    let ended = browser.value(&format!("{drills}.querySelector('time').dateTime"));
    assert_eq!(ended, drill["passed_at"]);
    assert_eq!(browser.complaints, [""; 0]);
}
