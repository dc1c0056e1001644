//! The page in a real browser, over a real daemon. Without Chromium every test is ignored.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    reason = "a test fails by panicking"
)]

mod accessible;
mod chromium;
mod drill;
mod found;
mod pace;
mod report;

use crate::site::{MARKUP, Site, TOKEN};
use chromium::Chromium;
use serde_json::{Value, json};
use std::path::PathBuf;

const DESKTOP: (u32, u32) = (1200, 900);
const PHONE: (u32, u32) = (390, 844);
/// Where pictures are put; `SLIPWATCH_SCREENS=docs/screens` renews those that are kept.
fn screens() -> PathBuf {
    let kept = std::env::var("SLIPWATCH_SCREENS").map(|folder| {
        let root = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
        root.join(folder)
    });
    kept.unwrap_or_else(|_| env!("CARGO_TARGET_TMPDIR").into())
}

/// A daemon and a browser that has entered the token by hand.
fn open(place: &str) -> (Site, Chromium) {
    open_on(Site::start, place)
}

fn open_on(start: impl Fn() -> Site, place: &str) -> (Site, Chromium) {
    let mut browser = Chromium::start();
    let site = start();
    browser.look(DESKTOP, false);
    browser.visit(&site.address(place));
    browser.until("document.getElementById('enter')?.open");
    browser.type_in(TOKEN);
    browser.press("Enter", 13);
    browser.until("document.documentElement.dataset.shown");
    // The refusal before the token was there.
    browser
        .complaints
        .retain(|complaint| !complaint.contains("401"));
    (site, browser)
}

fn row(benchmark: &str) -> String {
    format!("tr[data-benchmark={}]", json!(benchmark))
}

/// A time as the page says it in its element.
fn said_time(browser: &mut Chromium, selector: &str) -> Value {
    let selector = json!(selector);
    browser.value(&format!(
        "document.querySelector({selector})?.getAttribute('datetime')"
    ))
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "Chromium was not found by build.rs")]
fn the_site_page_shows_the_numbers_of_the_api_and_a_name_that_is_markup_is_a_name() {
    let (site, mut browser) = open("");
    let answer = site.json("/api/site");
    let standings = answer["benchmarks"].as_array().unwrap();
    assert_eq!(standings.len(), 3);
    for standing in standings {
        let name = standing["benchmark"].as_str().unwrap();
        let (row, cell) = (row(name), |column: &str| {
            format!("{} td[data-name={}]", row(name), json!(column))
        });
        let text = browser.text(&row);
        assert!(text.contains(name), "{text}");
        assert!(text.contains(standing["level"].as_str().unwrap()), "{text}");
        let velocity = standing["velocity_mm_per_day"].as_f64().unwrap();
        let shown = browser.text(&cell("Velocity"));
        let shown: f64 = shown
            .trim_start_matches("Velocity")
            .trim_end_matches("mm/day")
            .trim()
            .parse()
            .unwrap();
        assert!(
            (shown - velocity).abs() <= 0.01 * velocity.abs(),
            "{shown} {velocity}"
        );
        let newest = said_time(&mut browser, &format!("{} time", cell("Newest reading")));
        assert_eq!(newest, standing["newest_reading"]);
        let median = said_time(&mut browser, &format!("{} time", cell("Collapse forecast")));
        assert_eq!(median, standing["failure_time"]["median"], "{name}");
    }
    // The worst first, and its shape is there beside the colour and the word.
    let first = browser.value("document.querySelector('tbody tr').dataset.level");
    assert_eq!(first, "red");
    let shape = browser.value("document.querySelector('tbody tr .level.red svg path') !== null");
    assert_eq!(shape, true);
    let marked =
        browser.value("document.querySelectorAll('svg.sketch')[0].querySelectorAll('a').length");
    assert_eq!(marked, 3);
    assert_eq!(browser.value("window.pwned === undefined"), true);
    let of_markup = site.address(&format!(
        "#/b/{}",
        "%3Cscript%3Ewindow.pwned%3D1%3C%2Fscript%3E"
    ));
    browser.value(&format!("location.href = {}", json!(of_markup)));
    browser.until(&format!(
        "document.querySelector('h1')?.innerText === {}",
        json!(MARKUP)
    ));
    assert_eq!(browser.value("window.pwned === undefined"), true);
    assert_eq!(browser.complaints, [""; 0]);
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "Chromium was not found by build.rs")]
fn an_order_given_on_the_page_is_in_the_log_with_the_name_of_who_gave_it() {
    let (site, mut browser) = open("#/b/E3");
    browser.click("button[data-order=acknowledge]");
    browser.until("document.getElementById('order').open");
    browser.click("#order-give");
    browser.until("document.getElementById('order-wrong').innerText === 'A name is needed.'");
    browser.click("#by");
    browser.type_in("Anna");
    browser.click("#why");
    browser.type_in("the road is closed");
    browser.click("#order-give");
    browser.until("!document.getElementById('order').open");
    browser.until("document.querySelector('main').innerText.includes('acknowledge by Anna: the road is closed')");
    browser.until("document.querySelector('.head').innerText.includes('seen by Anna')");
    browser.click("button[data-order=silence]");
    browser.until("document.getElementById('order').open");
    // The reason of one order is not that of the next.
    assert_eq!(browser.value("document.getElementById('why').value"), "");
    browser.value("document.getElementById('span').value = '28800'");
    browser.click("#order-give");
    browser.until(
        "document.querySelector('.head').innerText.includes('not notified: silence by Anna')",
    );
    let orders = site.events("order");
    let given: Vec<[&Value; 4]> = orders
        .iter()
        .map(|order| {
            [
                &order["order"],
                &order["benchmark"],
                &order["by"],
                &order["why"],
            ]
        })
        .collect();
    let anna = json!("Anna");
    let (acknowledge, silence, e3) = (json!("acknowledge"), json!("silence"), json!("E3"));
    let (why, none) = (json!("the road is closed"), Value::Null);
    assert_eq!(
        given,
        [
            [&acknowledge, &e3, &anna, &why],
            [&silence, &e3, &anna, &none]
        ]
    );
    assert_eq!(browser.complaints, [""; 0]);
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "Chromium was not found by build.rs")]
fn the_slider_shows_a_moment_as_it_was_known_then_and_nothing_of_what_came_later() {
    let (site, mut browser) = open("#/b/E3");
    let alerts = site.events("alert");
    let of_e3 = |level: &str| {
        let is = |alert: &&Value| alert["benchmark"] == "E3" && alert["level"] == level;
        alerts.iter().find(is).unwrap()["time"]
            .as_str()
            .unwrap()
            .to_owned()
    };
    let (yellow, red) = (of_e3("yellow"), of_e3("red"));
    // Half-way from yellow to red.
    let share = format!(
        "(() => {{ const [from, to] = [Date.parse({}), Date.parse({})];
           document.getElementById('date').value = '';
           location.hash = `#/b/E3?at=${{new Date((from + to) / 2).toISOString()}}`; }})()",
        json!(yellow),
        json!(red)
    );
    browser.value(&share);
    browser.until("document.querySelector('.head .level')?.innerText.trim() === 'yellow'");
    assert!(browser.text("#banner").contains("As it was known at"));
    let at = browser.value("new URLSearchParams(location.hash.split('?')[1]).get('at')");
    // A forecast lies ahead; nothing that was said does. The lists are drawn in a frame after that of the level.
    browser.until(&format!(
        "(() => {{ const said = [...document.querySelectorAll('ul.log time')].map((one) => one.dateTime).sort();
           return said.length > 0 && said.pop() <= {at}; }})()"
    ));
    let known = site.json(&format!("/api/benchmark?id=E3&at={}", at.as_str().unwrap()));
    let newest = known["readings"]["t"]
        .as_array()
        .unwrap()
        .last()
        .unwrap()
        .as_f64()
        .unwrap();
    let instant: jiff::Timestamp = at.as_str().unwrap().parse().unwrap();
    assert!(newest <= instant.as_second() as f64);
    // By the keyboard: to the end is live again.
    browser.value("document.getElementById('slide').focus()");
    browser.press("End", 35);
    browser.until("document.getElementById('live').getAttribute('aria-pressed') === 'true'");
    browser.until("document.querySelector('.head .level')?.innerText.trim() === 'red'");
    assert_eq!(browser.complaints, [""; 0]);
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "Chromium was not found by build.rs")]
fn the_regime_plane_has_a_point_for_the_law_of_each_forecast_and_ends_where_the_newest_stands() {
    let (site, mut browser) = open("#/b/E3");
    browser.until("document.querySelector('svg.plane .here')");
    let view = site.json("/api/benchmark?id=E3");
    let forecasts = view["forecasts"].as_array().unwrap().iter();
    let laws = forecasts.filter_map(|one| {
        let of = |name: &str| one[name].as_f64();
        Some((
            of("r_per_day")?,
            of("kappa_per_day")?,
            of("probability_unstable")?,
        ))
    });
    let laws: Vec<(f64, f64, f64)> = laws.collect();
    assert!(laws.len() > 10, "{laws:?}");
    let points = browser.value("document.querySelectorAll('svg.plane .past').length");
    assert_eq!(points, laws.len().min(120));
    let here = browser.value(
        "['cx', 'cy', 'fill-opacity'].map((name) => Number(document.querySelector('svg.plane .here').getAttribute(name)))",
    );
    let [x, y, fill] = [0, 1, 2].map(|index| here[index].as_f64().unwrap());
    let (r, kappa, unstable) = laws[laws.len() - 1];
    // To the right of the middle unstable, above it accelerating.
    assert_eq!(
        (x > 185.0, y < 145.0),
        (kappa > 0.0, r > 0.0),
        "{here} {r} {kappa}"
    );
    assert!(
        (fill - 0.1 - 0.9 * unstable).abs() < 0.01,
        "{fill} {unstable}"
    );
    assert_eq!(browser.complaints, [""; 0]);
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "Chromium was not found by build.rs")]
fn a_drag_across_one_chart_zooms_all_of_them_and_asks_for_more_detail() {
    let (_site, mut browser) = open("#/b/E3");
    // The last chart: until it is drawn the others still move.
    browser.until("document.querySelector('figure[data-chart=levels] .u-over')");
    browser.value("window.asked = []; const had = window.fetch; window.fetch = (path, ...rest) => { window.asked.push(String(path)); return had(path, ...rest); }");
    browser.drag("figure[data-chart=displacement] .u-over", 0.4, 0.6);
    browser.until("window.asked.some((path) => path.includes('from=') && path.includes('to='))");
    let window = browser.value("window.asked.find((path) => path.includes('from='))");
    let length = browser.value(&format!(
        "(() => {{ const query = new URLSearchParams({window}.split('?')[1]); return (Date.parse(query.get('to')) - Date.parse(query.get('from'))) / 86400e3; }})()"
    ));
    // A fifth of the 45 days on the axis.
    let days = length.as_f64().unwrap();
    assert!((7.0..11.0).contains(&days), "{days}");
    assert_eq!(browser.complaints, [""; 0]);
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "Chromium was not found by build.rs")]
fn a_moment_outside_the_stretch_that_is_looked_at_moves_the_stretch() {
    let (site, mut browser) = open("#/b/E3");
    // The last chart: until it is drawn the others still move.
    browser.until("document.querySelector('figure[data-chart=levels] .u-over')");
    browser.value("window.asked = []; const had = window.fetch; window.fetch = (path, ...rest) => { window.asked.push(String(path)); return had(path, ...rest); }");
    browser.drag("figure[data-chart=displacement] .u-over", 0.5, 0.7);
    browser.until("window.asked.some((path) => path.includes('from=') && path.includes('to='))");
    let readings = &site.json("/api/benchmark?id=E3")["readings"]["t"];
    let early = readings[8].as_f64().unwrap();
    browser.value(&format!(
        "location.hash = `#/b/E3?at=${{new Date(1000 * {early}).toISOString()}}`"
    ));
    let moved =
        "window.asked.filter((path) => path.includes('at=') && path.includes('from=')).pop()";
    browser.until(moved);
    let asked = browser.value(moved);
    let shown = site.json(asked.as_str().unwrap());
    let times = shown["readings"]["t"].as_array().unwrap();
    assert!(times.len() > 3, "{asked}: {times:?}");
    // Back to the present the same.
    browser.click("#live");
    browser.until(
        "window.asked.filter((path) => path.includes('from=')).pop()?.includes('at=') === false",
    );
    let asked = browser.value("window.asked.filter((path) => path.includes('from=')).pop()");
    let shown = site.json(asked.as_str().unwrap());
    let newest = shown["readings"]["t"].as_array().unwrap().last().unwrap();
    assert_eq!(Some(newest), readings.as_array().unwrap().last());
    assert_eq!(browser.complaints, [""; 0]);
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "Chromium was not found by build.rs")]
fn a_date_is_written_year_first_in_the_zone_of_the_site_and_what_is_none_is_said() {
    let (_site, mut browser) = open("#/b/E3");
    let shown = browser.value("document.getElementById('date').value");
    let shown = shown.as_str().unwrap();
    let is_civil = jiff::civil::DateTime::strptime("%Y-%m-%d %H:%M", shown);
    assert!(is_civil.is_ok(), "{shown}");
    let mut write = |text: &str| {
        browser.value(&format!(
            "(() => {{ const date = document.getElementById('date'); date.value = {}; date.dispatchEvent(new Event('change')); }})()",
            json!(text)
        ));
        let at = browser.value("new URLSearchParams(location.hash.split('?')[1]).get('at')");
        let said = browser.value("document.getElementById('date').validationMessage");
        (at, said)
    };
    // Zurich is two hours ahead in May and one in January.
    for (text, at) in [
        ("2012-05-14 06:30", "2012-05-14T04:30:00.000Z"),
        ("2012-01-14", "2012-01-13T23:00:00.000Z"),
        ("2012-05-14T06:30:15Z", "2012-05-14T06:30:15.000Z"),
        ("2012-05-14T06:30-02:00", "2012-05-14T08:30:00.000Z"),
    ] {
        assert_eq!(write(text), (json!(at), json!("")), "{text}");
    }
    let (at, said) = write("05/14/2012");
    assert_eq!(at, "2012-05-14T08:30:00.000Z");
    assert!(
        said.as_str().unwrap().contains("2012-05-14 06:30"),
        "{said}"
    );
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "Chromium was not found by build.rs")]
fn a_finger_reads_values_and_looks_closer_where_that_is_asked_for() {
    let (site, mut browser) = open("#/b/E3");
    browser.look(PHONE, false);
    browser.visit("about:blank");
    browser.visit(&site.address("#/b/E3"));
    // The last chart: until it is drawn the others still move.
    browser.until("document.querySelector('figure[data-chart=levels] .u-over')");
    browser.value("window.asked = []; const had = window.fetch; window.fetch = (path, ...rest) => { window.asked.push(String(path)); return had(path, ...rest); }");
    let chart = "figure[data-chart=displacement] .u-over";
    browser.swipe(chart, 0.2, 0.5);
    // All charts say the value there.
    browser.until("/^20[0-9-]+ [0-9:]+: [0-9]+/.test(document.querySelector('figure[data-chart=displacement] .value').innerText)");
    browser.until("/^20[0-9-]+ [0-9:]+: [0-9.]+/.test(document.querySelector('figure[data-chart=velocity] .value').innerText)");
    std::thread::sleep(std::time::Duration::from_millis(500));
    let zoomed = "window.asked.some((path) => path.includes('from='))";
    assert_eq!(browser.value(zoomed), false);
    browser.click("button.finger");
    browser.swipe(chart, 0.2, 0.5);
    browser.until(zoomed);
    assert_eq!(browser.complaints, [""; 0]);
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "Chromium was not found by build.rs")]
fn a_daemon_that_is_lost_is_said_to_be_and_is_found_again_with_what_came_since() {
    let (mut site, mut browser) = open("");
    browser.until("document.getElementById('link').innerText.includes('live')");
    site.kill();
    browser.until("document.getElementById('link').innerText.includes('no connection')");
    assert!(browser.text("#banner").contains("What is shown is old"));
    // What was known stays to be read.
    assert!(browser.text("main").contains("E3"));
    let time = slipwatch::runtime::clock::now();
    site.append(&format!("{time},1400,1300,0.1,0"));
    site.run();
    browser.until("document.getElementById('link').innerText.includes('live')");
    let newest = json!(format!("{} time", row("E3")));
    browser.until(&format!("Date.parse([...document.querySelectorAll({newest})].map((one) => one.dateTime).sort()[1] ?? 0) > 0"));
    let expected = json!(time.to_string());
    let cell = json!(format!("{} td[data-name='Newest reading'] time", row("E3")));
    browser.until(&format!(
        "Date.parse(document.querySelector({cell}).dateTime) === Date.parse({expected})"
    ));
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "Chromium was not found by build.rs")]
fn it_fits_a_phone_is_reached_by_keyboard_and_is_photographed_light_and_dark() {
    let (site, mut browser) = open_on(|| Site::with("E1"), "");
    std::fs::create_dir_all(screens()).unwrap();
    for (view, place, ready) in [
        (
            "site",
            "#/",
            "document.querySelectorAll('tbody tr').length === 3",
        ),
        (
            "benchmark",
            "#/b/E3",
            "document.querySelectorAll('figure.chart canvas').length > 5",
        ),
    ] {
        for (size, window) in [("desktop", DESKTOP), ("phone", PHONE)] {
            for is_dark in [false, true] {
                browser.look(window, is_dark);
                // The same page at another place would not be loaded anew.
                browser.visit("about:blank");
                browser.visit(&site.address(place));
                browser.until("document.documentElement.dataset.shown");
                browser.until(ready);
                let theme = if is_dark { "dark" } else { "light" };
                assert_eq!(
                    browser.value("document.documentElement.dataset.theme"),
                    theme
                );
                let is_wide = browser.value("document.documentElement.scrollWidth > innerWidth");
                assert_eq!(is_wide, false, "{view} {size}");
                let file = screens().join(format!("{view}-{size}-{theme}.png"));
                browser.picture(&file, (view, size) == ("benchmark", "desktop"));
                assert!(std::fs::metadata(file).unwrap().len() > 10_000);
            }
        }
    }
    // Every control is reached by Tab, and the focus is seen.
    browser.look(DESKTOP, false);
    browser.visit(&site.address("#/"));
    browser.until(&format!(
        "document.querySelector({})",
        json!(format!("{} a", row("E3")))
    ));
    let mut reached = Vec::new();
    for _ in 0..45 {
        browser.press("Tab", 9);
        reached.push(browser.value(
            "(() => { const one = document.activeElement; return `${one.id || one.dataset.order || one.getAttribute('href') || one.tagName} ${getComputedStyle(one).outlineStyle}`; })()",
        ));
    }
    for wanted in [
        "live solid",
        "slide solid",
        "date",
        "theme solid",
        "#/b/E3 solid",
        "acknowledge solid",
    ] {
        let is_reached = reached
            .iter()
            .any(|one| one.as_str().unwrap().starts_with(wanted));
        assert!(is_reached, "{wanted}: {reached:?}");
    }
}
