//! The link in an alert's own message: what it acknowledges, once, and what it does not. The daemon is a process, asked on a socket.

use crate::notified::failing;
use crate::site::{Program, Site, eventually, get};
use base64::Engine;
use base64::engine::general_purpose::{STANDARD, URL_SAFE_NO_PAD};
use hmac::{Hmac, KeyInit, Mac};
use nix::sys::signal::Signal;
use std::fs;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::os::unix::fs::PermissionsExt;

const PUBLIC: &str = "https://slope.example.org/watch";
const TOKEN: &str = "0123456789abcdef-of-the-test";

/// A site whose messages have links, with an escalation that waits for an acknowledgement; and where it listens.
fn site() -> (Site, String) {
    let site = Site::new(
        "[[benchmark]]\nid = \"5\"\nsource = \"logger\"\n[alert]\nevacuation_time = \"3h\"\n\
         [[alert.threshold]]\nlevel = \"orange\"\ndisplacement = \"10 mm\"\n\
         [[hook]]\nrun = [\"/bin/sh\", \"next.sh\"]\nlevels = [\"red\"]\nescalate_after = \"1h\"\n",
    );
    fs::write(site.path("next.sh"), "echo $SLIPWATCH_KEY >> escalated\n").unwrap();
    let script = "echo $SLIPWATCH_KEY $SLIPWATCH_STATE >> notified\n\
                  echo \"$SLIPWATCH_KEY $SLIPWATCH_ACKNOWLEDGE_URL\" >> links\ncat >> bodies\n";
    fs::write(site.path("hook.sh"), script).unwrap();
    fs::write(site.path("token"), TOKEN).unwrap();
    let address = site.listen();
    let text = fs::read_to_string(site.path("site.toml")).unwrap();
    let more = format!("public_url = \"{PUBLIC}/\"\ntoken_file = \"token\"\nstate_dir");
    fs::write(site.path("site.toml"), text.replacen("state_dir", &more, 1)).unwrap();
    (site, address)
}

fn started(site: &Site, rows: std::ops::Range<i32>) -> Program {
    site.append(
        "incoming/5.csv",
        &format!("time,displacement_mm\n{}", failing(rows)),
    );
    site.caught_up()
}

/// The path of the link that the hook got with the alert whose key begins so.
fn link(site: &Site, begins: &str) -> String {
    let mut found = String::new();
    eventually("the link", || {
        let lines = site.lines("links");
        let words = lines.iter().filter_map(|line| line.split_once(' '));
        let mut of_it = words.filter(|(key, link)| key.starts_with(begins) && !link.is_empty());
        found = of_it
            .next()
            .map_or_else(String::new, |(_, link)| link.to_owned());
        !found.is_empty()
    });
    // As a proxy passes it on.
    found.strip_prefix(PUBLIC).unwrap().to_owned()
}

fn post(address: &str, path: &str, (headers, form): (&str, &str)) -> String {
    let mut stream = TcpStream::connect(address).unwrap();
    let length = form.len();
    let request = format!(
        "POST {path} HTTP/1.1\r\n{headers}content-type: application/x-www-form-urlencoded\r\n\
         content-length: {length}\r\nconnection: close\r\n\r\n{form}"
    );
    stream.write_all(request.as_bytes()).unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    answer
}

const OURS: &str = "host: slope.example.org\r\norigin: https://slope.example.org\r\n";

fn is(answer: &str, status: u16, words: &str) {
    assert!(
        answer.starts_with(&format!("HTTP/1.1 {status} ")) && answer.contains(words),
        "not {status} {words:?}: {answer}"
    );
}

fn standing(site: &Site) -> String {
    let database = rusqlite::Connection::open(site.path("state/slipwatch.db")).unwrap();
    let query = "SELECT status FROM outbox WHERE hook = '/bin/sh next.sh' AND level = 'red'";
    let found = database.query_row(query, [], |row| row.get(0));
    found.unwrap_or_default()
}

/// The path of a link as the daemon signs it.
fn signed(site: &Site, key: &str, until: i64) -> String {
    let text = fs::read_to_string(site.path("state/link.secret")).unwrap();
    let secret = STANDARD.decode(text.trim()).unwrap();
    let mut mac = Hmac::<sha2::Sha256>::new_from_slice(&secret).unwrap();
    mac.update(format!("slipwatch acknowledge 1\nActual\n{until}\n{key}").as_bytes());
    let signature = URL_SAFE_NO_PAD.encode(mac.finalize().into_bytes());
    let key = key.replace('/', "%2F").replace(':', "%3A");
    format!("/acknowledge?alert={key}&status=Actual&until={until}&signature={signature}")
}

fn orders(site: &Site) -> Vec<serde_json::Value> {
    let events = site.events();
    let all = events
        .lines()
        .map(|line| serde_json::from_str(line).unwrap());
    all.filter(|event: &serde_json::Value| event["event"] == "order")
        .collect()
}

/// Orders that were taken, or wait to be.
fn asked(site: &Site) -> usize {
    let database = rusqlite::Connection::open(site.path("state/slipwatch.db")).unwrap();
    let waiting = database.query_row("SELECT count(*) FROM command", [], |row| {
        row.get::<_, i64>(0)
    });
    orders(site).len() + usize::try_from(waiting.unwrap()).unwrap()
}

#[test]
fn the_link_in_a_message_acknowledges_its_alert_once_and_only_when_its_button_is_pressed() {
    let (site, address) = site();
    let program = started(&site, 0..114);
    let path = link(&site, "5/red/");
    let secret = fs::metadata(site.path("state/link.secret")).unwrap();
    assert_eq!(secret.permissions().mode() & 0o777, 0o600);
    eventually("the link in the message", || {
        let bodies = fs::read_to_string(site.path("bodies")).unwrap_or_default();
        bodies.contains(&format!("\"acknowledge_url\":\"{PUBLIC}{path}\""))
    });
    // A scanner of mail follows it, more than once.
    for _ in 0..2 {
        let page = get(&address, &path);
        is(&page, 200, "<form method=\"post\">");
        assert!(page.contains("Toc: red, benchmark 5"), "{page}");
        assert!(page.contains("cache-control: no-store"), "{page}");
    }
    assert_eq!(asked(&site), 0, "a look acknowledges nothing");
    eventually("that the escalation waits", || standing(&site) == "waiting");
    let taken = post(&address, &path, (OURS, "by=Anna+%3Cb%3E"));
    is(&taken, 200, "The alert is acknowledged");
    eventually("that it is called off", || {
        standing(&site) == "acknowledged"
    });
    eventually("that it stands in the log", || orders(&site).len() == 1);
    for again in [
        post(&address, &path, (OURS, "by=Bert")),
        get(&address, &path),
    ] {
        is(&again, 410, "This link has been used");
        assert!(again.contains("by Anna &lt;b&gt;"), "{again}");
    }
    let orders = orders(&site);
    assert_eq!(orders.len(), 1, "{orders:?}");
    let key = site
        .lines("notified")
        .into_iter()
        .find(|line| line.starts_with("5/red/"));
    let key = key.unwrap().replace(" firing", "");
    for (name, value) in [
        ("order", "acknowledge"),
        ("door", "link"),
        ("by", "Anna <b>"),
        ("benchmark", "5"),
        ("alert", &key),
    ] {
        assert_eq!(orders[0][name], value, "{name}");
    }
    let shown = site.printed(&["alerts", "show", "5/red", "--config", "site.toml"]);
    assert!(shown.contains("over the link in its message"), "{shown}");
    program.stop();
    // Over a restart too, and with another link of the same alert.
    let program = site.caught_up();
    let until = slipwatch::runtime::clock::now().as_second() + 60;
    let other = post(&address, &signed(&site, &key, until), (OURS, ""));
    is(&other, 410, "This link has been used");
    program.stop();
    site.proven_events();
}

#[test]
fn a_link_that_is_forged_expired_foreign_or_over_changes_nothing() {
    let (site, address) = site();
    // Too few readings for a forecast: orange by the threshold alone.
    let program = started(&site, 0..8);
    let orange = link(&site, "5/orange/");
    site.append("incoming/5.csv", &failing(8..114));
    let red = link(&site, "5/red/");
    let key = site
        .lines("notified")
        .into_iter()
        .find(|line| line.starts_with("5/red/"));
    let key = key.unwrap().replace(" firing", "");
    let now = slipwatch::runtime::clock::now().as_second();
    let (cut, _) = red.split_once("&signature").unwrap();
    for (path, status, words) in [
        (
            red.replace("5%2Fred", "6%2Fred"),
            403,
            "This link is not valid",
        ),
        (
            red.replace("&until=1", "&until=9"),
            403,
            "This link is not valid",
        ),
        (red.replace("Actual", "Test"), 403, "This link is not valid"),
        (
            red[..red.len() - 1].to_owned(),
            403,
            "This link is not valid",
        ),
        (cut.to_owned(), 403, "This link is not valid"),
        (signed(&site, &key, now - 1), 410, "This link has expired"),
        (
            signed(&site, "7/red/2020", now + 60),
            404,
            "There is no such alert",
        ),
        // What a person at the command line may shorten a link may not.
        (
            signed(&site, "5/red", now + 60),
            404,
            "There is no such alert",
        ),
        (orange, 410, "A higher level has taken its place"),
    ] {
        is(&get(&address, &path), status, words);
        is(&post(&address, &path, (OURS, "by=Eve")), status, words);
    }
    // Under another name, or from another page, not even a good one is answered.
    let foreign = "host: slope.example.org\r\norigin: https://evil.example\r\n";
    for headers in [foreign, "host: evil.example\r\n"] {
        is(&post(&address, &red, (headers, "by=Eve")), 403, "");
    }
    let long = format!("by={}", "x".repeat(101));
    is(&post(&address, &red, (OURS, &long)), 422, "100 bytes");
    // The link opens nothing else.
    is(&get(&address, "/api/site"), 401, "");
    assert_eq!(asked(&site), 0);
    assert_eq!(standing(&site), "waiting");
    is(
        &post(&address, &red, (OURS, "")),
        200,
        "The alert is acknowledged",
    );
    program.stop();
    site.proven_events();
}

#[test]
fn another_public_address_and_another_token_count_from_the_reload_on() {
    let (site, address) = site();
    // Orange by the threshold alone.
    let program = started(&site, 0..8);
    link(&site, "5/orange/");
    let (other, other_token) = ("http://other.example", "fedcba9876543210-of-the-test");
    let text = fs::read_to_string(site.path("site.toml")).unwrap();
    let text = text.replace(PUBLIC, other);
    fs::write(site.path("site.toml"), text).unwrap();
    fs::write(site.path("token"), other_token).unwrap();
    assert!(opens(&address, TOKEN) && !opens(&address, other_token));
    program.signal(Signal::SIGHUP);
    eventually("the new token", || opens(&address, other_token));
    assert!(!opens(&address, TOKEN), "the former token still opens");
    site.append("incoming/5.csv", &failing(8..114));
    let mut path = String::new();
    eventually("a link under the new address", || {
        let lines = site.lines("links");
        let red = lines.iter().find(|line| line.starts_with("5/red/"));
        let found = red.and_then(|line| line.split_once(other));
        path = found.map_or_else(String::new, |(_, path)| path.to_owned());
        !path.is_empty()
    });
    is(&post(&address, &path, (OURS, "by=Eve")), 403, "");
    let ours = "host: other.example\r\norigin: http://other.example\r\n";
    let taken = post(&address, &path, (ours, "by=Anna"));
    is(&taken, 200, "The alert is acknowledged");
    program.stop();
    site.proven_events();
}

/// Whether the daemon lets in whoever knows that token.
fn opens(address: &str, token: &str) -> bool {
    let mut stream = TcpStream::connect(address).unwrap();
    let request = format!(
        "GET /api/site HTTP/1.1\r\nhost: localhost\r\nauthorization: Bearer {token}\r\n\
         connection: close\r\n\r\n"
    );
    stream.write_all(request.as_bytes()).unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    answer.starts_with("HTTP/1.1 200 ")
}

#[test]
fn without_a_usable_secret_an_alert_goes_out_without_a_link() {
    let (site, _) = site();
    fs::create_dir(site.path("state")).unwrap();
    fs::write(site.path("state/link.secret"), "for everyone\n").unwrap();
    let readable = fs::Permissions::from_mode(0o644);
    fs::set_permissions(site.path("state/link.secret"), readable).unwrap();
    let program = started(&site, 0..114);
    eventually("the red", || {
        let notified = site.lines("notified");
        notified.iter().any(|line| line.starts_with("5/red/"))
    });
    assert!(site.log().contains("chmod 600"), "{}", site.log());
    assert!(
        site.lines("links")
            .iter()
            .all(|line| !line.contains("http"))
    );
    program.stop();
}
