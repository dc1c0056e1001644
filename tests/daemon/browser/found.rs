//! An effect that the daemon finds, on the page.

use super::{DESKTOP, TOKEN, Value, json};
use crate::browser::chromium::Chromium;
use crate::site::Site;
use jiff::{SignedDuration, Timestamp};
use std::fmt::Write as _;

/// Readings each six hours, of which so many are there at the start.
const READINGS: u32 = 480;
const PAST: u32 = 420;
/// The reservoir rises and falls in so many days, and acts after so many.
const CYCLE: f64 = 37.0;
const DELAY: f64 = 4.0;
const GAIN: f64 = 0.6;

/// A slope that creeps at 5 mm/day under a reservoir, with noise of a tenth of a millimetre: (header, rows).
fn beside_a_reservoir(newest: Timestamp) -> Vec<String> {
    let (mut response, mut mm) = (0.0, 0.0);
    let row = |index: u32| {
        let day = 0.25 * f64::from(index);
        let level = (std::f64::consts::TAU * day / CYCLE).sin();
        response += (level - response) * 0.25 / DELAY;
        mm += 0.25 * 5.0 * f64::exp(GAIN * response);
        let noise = 0.1 * (f64::from(index) * 12.9898).sin() * (f64::from(index) * 4.1).cos();
        let ago = SignedDuration::from_hours(6 * i64::from(READINGS - 1 - index));
        format!("{},{:.3},{level:.4}", newest - ago, mm + noise)
    };
    (0..READINGS).map(row).collect()
}

fn config(port: u16) -> String {
    format!(
        "[site]\nname = \"Beside a reservoir\"\nstate_dir = \"state\"\nlisten = \"127.0.0.1:{port}\"\ntoken_file = \"token\"\n\
         [[source]]\nid = \"logger\"\nkind = \"csv\"\npath = \"slope.csv\"\n[[hook]]\nrun = [\"/bin/true\"]\n"
    )
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "Chromium was not found by build.rs")]
fn the_load_that_nobody_declared_is_drawn_before_and_after_what_was_found() {
    let rows = beside_a_reservoir(slipwatch::runtime::clock::now() - SignedDuration::from_hours(1));
    let mut past = "time,p1_displacement_mm,reservoir_level_m\n".to_owned();
    for row in &rows[..PAST as usize] {
        writeln!(past, "{row}").unwrap();
    }
    let site = Site::of(&past, config);
    let mut rest = rows[PAST as usize..].iter();
    while site.events("effect-found").is_empty() {
        site.append(rest.next().expect("no effect was found"));
        std::thread::sleep(std::time::Duration::from_millis(500));
    }
    let found = &site.events("effect-found")[0];
    assert_eq!(found["channel"], "reservoir_level_m", "{found}");
    let mut browser = Chromium::start();
    browser.look(DESKTOP, false);
    browser.visit(&site.address("#/b/p1"));
    browser.until("document.getElementById('enter')?.open");
    browser.type_in(TOKEN);
    browser.press("Enter", 13);
    let chart = "figure[data-chart=undeclared]";
    browser.until(&format!(
        "document.querySelector({})",
        json!(format!("{chart} canvas"))
    ));
    let caption = browser.text(&format!("{chart} figcaption"));
    assert!(caption.contains("before what was found"), "{caption}");
    let text = browser.text("main");
    let said = "effect found: hydrological by reservoir_level_m";
    assert!(text.contains(said), "{text}");
    // What is drawn is what the event says.
    let view = site.json("/api/benchmark?id=p1");
    let marks = view["marks"].as_array().unwrap();
    let load = marks
        .iter()
        .rfind(|mark| mark["undeclared_load"].is_object());
    let [before, after] =
        ["before", "after"].map(|name| largest(&load.unwrap()["undeclared_load"][name]));
    assert!(before > 0.3 && after < 0.5 * before, "{before} {after}");
}

fn largest(values: &Value) -> f64 {
    let values = values.as_array().unwrap().iter();
    values.fold(0.0, |most, value| value.as_f64().unwrap().abs().max(most))
}
