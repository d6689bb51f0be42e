//! `dgd watch`: serves a page, reports saves, and ends with Ctrl-C.

use std::fs;
use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

#[cfg(unix)]
use crate::support::interrupt;
use crate::support::{command, dgd, dgd_in, root};

/// The program, ended with the test.
struct Watch {
    child: Child,
    host: String,
    secret: String,
}

impl Drop for Watch {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Watch {
    fn new(folder: &Path, words: &[&str]) -> Watch {
        let words = [&["watch", "--format", "json"], words].concat();
        let mut child = command(folder, &words)
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("the command starts");
        let mut line = String::new();
        let out = child.stdout.take().expect("it is piped");
        BufReader::new(out).read_line(&mut line).expect("it says its address");
        let text: Value = serde_json::from_str(&line).expect("a line of JSON");
        let address = text["address"].as_str().expect("an address");
        let rest = address.strip_prefix("http://").expect("an address");
        let (host, secret) = rest.split_once("/#").expect("a secret");
        Watch { child, host: host.to_owned(), secret: secret.to_owned() }
    }

    fn send(&self, first: &str, body: &str) -> TcpStream {
        let mut stream = TcpStream::connect(&self.host).expect("it listens");
        stream.set_read_timeout(Some(Duration::from_mins(1))).expect("a socket");
        let (host, secret, length) = (&self.host, &self.secret, body.len());
        let head = format!(
            "{first} HTTP/1.1\r\nHost: {host}\r\nX-Dgd-Secret: {secret}\r\nContent-Length: {length}\r\nConnection: close\r\n\r\n"
        );
        stream
            .write_all(head.as_bytes())
            .and_then(|()| stream.write_all(body.as_bytes()))
            .expect("it reads");
        stream
    }

    fn asked(&self, body: &str) -> Value {
        let mut text = String::new();
        self.send("POST /ask", body).read_to_string(&mut text).expect("a reply");
        let (_, body) = text.split_once("\r\n\r\n").expect("a body");
        serde_json::from_str(body).unwrap_or_else(|error| panic!("{error}: {text}"))
    }
}

/// The last simulated value of an output.
fn last(answer: &Value, output: &str) -> f64 {
    let charts = &answer["charts"];
    let panels = charts["figures"][0]["panels"].as_array().unwrap_or_else(|| panic!("{answer}"));
    let panel = panels.iter().find(|panel| panel["title"] == output).expect("the output's panel");
    let column = panel["series"][0]["y"].as_u64().expect("a column") as usize;
    let values = charts["columns"][column].as_array().expect("numbers");
    values.last().and_then(Value::as_f64).expect("a number")
}

#[test]
fn a_save_is_told_and_what_is_drawn_then_is_what_simulate_gives() {
    let folder = tempfile::tempdir().expect("a folder for the test");
    let model = folder.path().join("mud_circulation.dgd");
    let text = fs::read_to_string(root().join("models/mud_circulation.dgd")).expect("the model");
    fs::write(&model, &text).expect("the folder is writable");
    let data = root().join("examples/data/circulation.csv");
    let words = ["mud_circulation.dgd", "--data", &data.display().to_string(), "--every", "60"];
    let watch = Watch::new(folder.path(), &words);
    let simulated = |more: &[&str]| {
        let words = [&["simulate"], &words[..], more, &["--format", "json"]].concat();
        let result = dgd_in(folder.path(), &words).done().json();
        let columns = result["columns"].as_array().expect("columns").clone();
        let column = columns.iter().find(|column| column["name"] == "p_r").expect("an output");
        column["values"].as_array().and_then(|all| all.last()?.as_f64()).expect("a number")
    };
    let before = watch.asked("{}");
    // A page has the visible digits only.
    let close = |a: f64, b: f64| (a - b).abs() < 1e-5 * b.abs();
    assert!(close(last(&before, "p_r"), simulated(&[])), "{before}");
    let moved = watch.asked(r#"{"values":{"c0":280}}"#);
    assert!(close(last(&moved, "p_r"), simulated(&["--set", "c0=280"])));
    assert!(!close(last(&moved, "p_r"), last(&before, "p_r")));

    let mut events = watch.send("GET /events", "");
    let mut heard = String::new();
    let mut hear = |part: &str, times: usize| {
        let mut bytes = [0; 512];
        while heard.matches(part).count() < times {
            let n = events.read(&mut bytes).expect("an event comes");
            assert!(n > 0, "it ended: {heard}");
            heard.push_str(&String::from_utf8_lossy(&bytes[..n]));
        }
    };
    hear("text/event-stream", 1);
    std::thread::sleep(Duration::from_millis(250));
    let began = Instant::now();
    fs::write(&model, text.replace("= 275 ", "= 290 ")).expect("the folder is writable");
    hear("event: saved", 1);
    let after = watch.asked("{}");
    println!(
        "from a save to the answer that has it: {:.0} ms",
        began.elapsed().as_secs_f64() * 1e3
    );
    assert!(close(last(&after, "p_r"), simulated(&[])));
    assert!(!close(last(&after, "p_r"), last(&before, "p_r")));
    // A mistake is reported with its line.
    fs::write(&model, text.replace("- q_tf\n", "- q_tff\n")).expect("the folder is writable");
    hear("event: saved", 2);
    let wrong = watch.asked("{}");
    let line = text.lines().position(|line| line.starts_with("equation riser")).map(|k| k + 1);
    assert_eq!(wrong["mistakes"][0]["places"][0]["line"].as_u64().map(|n| n as usize), line);
}

#[cfg(unix)]
#[test]
fn control_c_ends_it() {
    let model = root().join("models/van_der_pol.dgd").display().to_string();
    let mut watch = Watch::new(&root(), &[&model, "--until", "1"]);
    assert_eq!(watch.asked("{}")["ok"], Value::Bool(true));
    interrupt(&watch.child);
    assert_eq!(watch.child.wait().expect("it ends").code(), Some(130));
}

#[test]
fn what_cannot_be_watched_is_refused() {
    dgd(&["watch", "models/none.dgd"]).refused(1, &["`models/none.dgd`"]);
    let model = "models/mud_circulation.dgd";
    dgd(&["watch", model, "--data", "none.csv"]).refused(1, &["`none.csv`"]);
    dgd(&["watch", model, "--plot", "x.svg"]).refused(2, &["--plot", "dgd simulate"]);
    dgd(&["watch", model, "--port", "70000"]).refused(2, &["65535"]);
    let taken = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = taken.local_addr().expect("an address").port().to_string();
    dgd(&["watch", model, "--port", &port]).refused(1, &[&port]);
}
