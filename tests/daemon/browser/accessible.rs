//! Accessibility by axe-core (Deque Systems), which the Python package axe-core-python brings.

use super::{DESKTOP, PHONE, open, row};
use crate::browser::chromium::Chromium;
use serde_json::{Value, json};
use std::process::Command;

/// The text of axe-core.
fn axe() -> String {
    let find = "import axe_core_python as axe, pathlib; \
                print((pathlib.Path(axe.__file__).parent / 'axe.min.js').read_text())";
    let output = Command::new("python3").args(["-c", find]).output().unwrap();
    assert!(output.status.success(), "{output:?}");
    String::from_utf8(output.stdout).unwrap()
}

/// Each violation on the page as it stands: the rule and the elements.
fn violations(browser: &mut Chromium, axe: &str) -> Vec<String> {
    browser.value(&format!("(() => {{ {axe}; return 1; }})()"));
    let found = browser.value(
        "axe.run(document, { resultTypes: ['violations'] }).then((all) => all.violations.map((one) =>
            `${one.id}: ${one.nodes.map((node) => node.html).join(' | ')}`))",
    );
    let each = found.as_array().unwrap().iter();
    each.map(|one| one.as_str().unwrap().to_owned()).collect()
}

#[test]
#[cfg_attr(
    not(all(has_chromium, has_axe)),
    ignore = "Chromium or axe-core (pip install axe-core-python) was not found by build.rs"
)]
fn axe_finds_no_violation_on_either_page_in_light_and_dark_nor_in_an_order() {
    let (site, mut browser) = open("");
    let axe = axe();
    for (place, ready) in [
        ("#/", "document.querySelectorAll('tbody tr').length === 3"),
        (
            "#/b/E3",
            "document.querySelectorAll('figure.chart canvas').length > 5",
        ),
    ] {
        for (window, is_dark) in [(DESKTOP, false), (DESKTOP, true), (PHONE, false)] {
            browser.look(window, is_dark);
            browser.visit("about:blank");
            browser.visit(&site.address(place));
            browser.until(ready);
            let none: Vec<String> = Vec::new();
            assert_eq!(violations(&mut browser, &axe), none, "{place} {is_dark}");
        }
    }
    browser.look(DESKTOP, false);
    browser.visit(&site.address("#/"));
    browser.until(&format!("document.querySelector({})", json!(row("E3"))));
    browser.click("button[data-order=acknowledge]");
    browser.until("document.querySelector('dialog[open]')");
    let none: Vec<String> = Vec::new();
    assert_eq!(violations(&mut browser, &axe), none, "an order");
    // It does find what is wrong.
    browser.value(
        "document.body.append(Object.assign(document.createElement('img'), { src: 'data:,' }))",
    );
    let wrong = violations(&mut browser, &axe);
    assert!(
        wrong.iter().any(|one| one.starts_with("image-alt")),
        "{wrong:?}"
    );
    assert_ne!(browser.value("document.title"), Value::Null);
}
