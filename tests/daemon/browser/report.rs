//! A report on the screen and on paper.

use super::{DESKTOP, PHONE, json};
use crate::browser::chromium::Chromium;
use crate::site::PROGRAM;
use assert_cmd::Command;

/// A4 between margins of a centimetre, as the browser has it, pixels.
const SHEET: (u32, u32) = (718, 1046);

#[test]
#[cfg_attr(not(has_chromium), ignore = "Chromium was not found by build.rs")]
fn every_table_of_a_report_is_seen_whole_on_a_screen_and_on_paper() {
    let folder = tempfile::tempdir().unwrap();
    Command::new(PROGRAM)
        .args([
            "report",
            "recordings/preonzo-2012.mcap",
            "--benchmark",
            "E1",
        ])
        .args(["--failure-time", "2012-05-15T01:30:00Z", "-o"])
        .arg(folder.path())
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .assert()
        .success();
    let address = format!("file://{}/report.html", folder.path().display());
    let mut browser = Chromium::start();
    for (size, is_printed) in [(DESKTOP, false), (SHEET, true)] {
        browser.look(size, false);
        browser.print(is_printed);
        browser.visit(&address);
        browser.until("document.querySelectorAll('.scores td').length > 20");
        let cut = browser.value(
            "[...document.querySelectorAll('.wide')].filter((one) => one.scrollWidth > one.clientWidth).map((one) => one.innerText)",
        );
        assert_eq!(cut, json!([]), "{size:?}");
        let wide = browser.value("document.documentElement.scrollWidth - innerWidth");
        assert!(wide.as_i64().unwrap() <= 0, "{size:?}: {wide}");
        // No text of a figure stands beyond its sheet.
        let beyond = browser.value(
            "[...document.querySelectorAll('svg')].flatMap((svg) => [...svg.querySelectorAll('text')].filter((text) => text.getBoundingClientRect().right > svg.getBoundingClientRect().right + 1).map((text) => text.textContent))",
        );
        assert_eq!(beyond, json!([]), "{size:?}");
    }
    browser.print(false);
    browser.look(PHONE, false);
    browser.visit(&address);
    browser.until("document.querySelectorAll('.scores td').length > 20");
    let wide = browser.value("document.documentElement.scrollWidth - innerWidth");
    assert!(wide.as_i64().unwrap() <= 0, "{wide}");
}
