//! How fast the page is with ten benchmarks of 100,000 readings each; it prints figures and asserts none.
//!
//!     cargo test --test daemon browser::pace -- --ignored --nocapture

use super::{DESKTOP, json};
use crate::browser::chromium::Chromium;
use crate::site::{Site, TOKEN};
use jiff::SignedDuration;
use std::fmt::Write as _;

const BENCHMARKS: i64 = 10;
const READINGS: i64 = 100_000;

/// Ten that creep, read each minute.
fn readings() -> String {
    let newest = slipwatch::runtime::clock::now();
    let mut text = String::from("time");
    for benchmark in 0..BENCHMARKS {
        write!(text, ",p{benchmark}_displacement_mm").unwrap();
    }
    for index in 0..READINGS {
        let time = newest - SignedDuration::from_mins(READINGS - index);
        write!(text, "\n{time}").unwrap();
        for benchmark in 0..BENCHMARKS {
            let noise = ((index * 7919 + benchmark * 104_729) % 1000) as f64 / 1000.0;
            let mm = 1e-3 * (benchmark + 1) as f64 * index as f64 + noise;
            write!(text, ",{mm:.3}").unwrap();
        }
    }
    text.push('\n');
    text
}

fn config(port: u16) -> String {
    format!(
        "[site]\nname = \"Ten\"\nstate_dir = \"state\"\nlisten = \"127.0.0.1:{port}\"\ntoken_file = \"token\"\n\
         [[source]]\nid = \"logger\"\nkind = \"csv\"\npath = \"slope.csv\"\n[[hook]]\nrun = [\"/bin/true\"]\n"
    )
}

#[test]
#[ignore = "it measures, for minutes: run it by name"]
fn paint_and_frames_with_a_million_readings() {
    let site = Site::of(&readings(), config);
    let mut browser = Chromium::start();
    browser.look(DESKTOP, false);
    browser.visit(&site.address(""));
    browser.until("document.getElementById('enter')?.open");
    browser.type_in(TOKEN);
    browser.press("Enter", 13);
    browser.until("document.documentElement.dataset.shown");
    // A line of text from the same daemon: what no page of ours can be faster than in this browser.
    for place in ["nothing-but-a-line-of-text", "#/", "#/b/p3"] {
        let is_ours = place.starts_with('#');
        let watch = "window.frames_ms = []; (() => { let last = performance.now(); const next = (now) => { frames_ms.push(now - last); last = now; requestAnimationFrame(next); }; requestAnimationFrame(next); })();";
        browser.call(
            "Page.addScriptToEvaluateOnNewDocument",
            &json!({ "source": watch }),
        );
        browser.visit("about:blank");
        browser.visit(&site.address(place));
        browser.until(if is_ours {
            "document.documentElement.dataset.shown"
        } else {
            "performance.getEntriesByName('first-contentful-paint').length > 0 && frames_ms.length > 60"
        });
        if place == "#/b/p3" {
            browser.until("document.querySelectorAll('figure.chart canvas').length > 5");
            browser.drag("figure[data-chart=displacement] .u-over", 0.3, 0.6);
            std::thread::sleep(std::time::Duration::from_secs(2));
        }
        let paint =
            browser.value("performance.getEntriesByName('first-contentful-paint')[0]?.startTime");
        let longest = browser.value("Math.max(...frames_ms.slice(2))");
        let size = browser.value("performance.getEntriesByType('resource').filter((one) => one.name.includes('/page/')).reduce((sum, one) => sum + one.decodedBodySize, 0)");
        println!(
            "{place}: first paint {paint} ms, longest frame {longest} ms, {size} bytes of scripts and styles"
        );
    }
}
