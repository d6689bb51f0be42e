//! Requests as the page sends them, and as others might.

use std::fs;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};

use dgd_work::RunRequest;
use serde_json::Value;

use super::{limits, serve};

const MODEL: &str = "model cooling\n\
    parameter tau [s] = 120 in 1 .. 1e4  # by guess\n\
    state T [K] = 80\n\
    equation cooling: tau*der(T) = -T\n\
    output T [K] noise 0.1\n";

/// A separate server for a test, which ends with the process.
struct Served {
    port: u16,
    secret: String,
    model: PathBuf,
    _folder: tempfile::TempDir,
}

/// A reply.
struct Reply {
    status: u16,
    head: String,
    body: String,
}

impl Served {
    fn new() -> Served {
        let folder = tempfile::tempdir().expect("a folder for the test");
        let model = folder.path().join("cooling.dgd");
        fs::write(&model, MODEL).expect("the folder is writable");
        let mut request = RunRequest::new(&model);
        request.solve.until = Some(300.0);
        let (told, address) = mpsc::channel();
        thread::spawn(move || {
            serve(request, 0, |address| told.send(address.to_owned()).expect("it is heard"))
        });
        let address = address.recv_timeout(Duration::from_secs(30)).expect("it begins to serve");
        let rest = address.strip_prefix("http://127.0.0.1:").expect("this machine alone");
        let (port, secret) = rest.split_once("/#").expect("a secret behind the #");
        let port = port.parse().expect("a port");
        Served { port, secret: secret.to_owned(), model, _folder: folder }
    }

    fn host(&self) -> String {
        format!("127.0.0.1:{}", self.port)
    }

    fn send(&self, text: &str) -> TcpStream {
        let mut stream = TcpStream::connect(self.host()).expect("it listens");
        stream.set_read_timeout(Some(Duration::from_secs(30))).expect("a socket");
        stream.write_all(text.as_bytes()).expect("it reads");
        stream
    }

    /// A request with these header lines.
    fn raw(&self, first: &str, head: &[String], body: &str) -> Reply {
        let length = format!("Content-Length: {}", body.len());
        let head = [&[first.to_owned()], head, &[length, "Connection: close".to_owned()]].concat();
        let mut stream = self.send(&format!("{}\r\n\r\n{body}", head.join("\r\n")));
        let mut text = String::new();
        stream.read_to_string(&mut text).expect("a reply");
        let (head, body) = text.split_once("\r\n\r\n").expect("a head");
        let status = head.split(' ').nth(1).and_then(|code| code.parse().ok()).expect("a status");
        Reply { status, head: head.to_ascii_lowercase(), body: body.to_owned() }
    }

    /// A request as the page sends it, with additional header lines.
    fn own(&self, first: &str, more: &[String], body: &str) -> Reply {
        let head = [format!("Host: {}", self.host()), format!("X-Dgd-Secret: {}", self.secret)];
        self.raw(first, &[&head, more].concat(), body)
    }

    fn asked(&self, body: &str) -> Value {
        let reply = self.own("POST /ask HTTP/1.1", &[], body);
        assert_eq!(reply.status, 200, "{}", reply.body);
        serde_json::from_str(&reply.body).expect("JSON")
    }
}

fn text(path: &Path) -> String {
    fs::read_to_string(path).expect("it is there")
}

#[test]
fn the_page_is_served_and_nothing_is_kept_or_let_out() {
    let served = Served::new();
    let host = format!("Host: {}", served.host());
    for (path, kind, part) in [
        ("/", "text/html", "watch.js"),
        ("/page.js", "text/javascript", "dgdPage"),
        ("/live.css", "text/css", ".parameter"),
        ("/icon.svg", "image/svg+xml", "<svg"),
    ] {
        let reply = served.raw(&format!("GET {path} HTTP/1.1"), std::slice::from_ref(&host), "");
        assert_eq!(reply.status, 200, "{path}");
        assert!(reply.body.contains(part) && reply.head.contains(kind), "{path} {}", reply.head);
        assert!(reply.head.contains("cache-control: no-store"), "{}", reply.head);
        assert!(reply.head.contains("content-security-policy: default-src 'none'"));
        assert!(!reply.head.contains("access-control-"), "no other origin is let in");
        assert!(!reply.body.contains("cooling") && !reply.body.contains(&served.secret));
    }
    assert_eq!(served.raw("GET /etc/passwd HTTP/1.1", std::slice::from_ref(&host), "").status, 404);
    assert_eq!(served.raw("GET /../Cargo.toml HTTP/1.1", &[host], "").status, 404);
}

#[test]
fn who_is_not_the_page_is_refused() {
    let served = Served::new();
    let host = || format!("Host: {}", served.host());
    let secret = || format!("X-Dgd-Secret: {}", served.secret);
    let other_secret = format!("X-Dgd-Secret: {}", "0".repeat(32));
    let port = served.port;
    let line = |text: &str| text.to_owned();
    for (why, first, head, status) in [
        ("no secret", "POST /ask HTTP/1.1", vec![host()], 403),
        ("another secret", "POST /ask HTTP/1.1", vec![host(), other_secret], 403),
        ("a part of it", "POST /ask HTTP/1.1", vec![host(), secret()[..30].to_owned()], 403),
        ("no secret to write", "POST /write HTTP/1.1", vec![host()], 403),
        ("no secret to hear", "GET /events HTTP/1.1", vec![host()], 403),
        ("no secret to begin", "GET /first HTTP/1.1", vec![host()], 403),
        ("another host", "POST /ask HTTP/1.1", vec![line("Host: evil.example"), secret()], 403),
        ("another host for the page", "GET / HTTP/1.1", vec![line("Host: evil.example")], 403),
        ("its port", "GET / HTTP/1.1", vec![format!("Host: evil.example:{port}")], 403),
        ("another port", "GET / HTTP/1.1", vec![line("Host: 127.0.0.1:1")], 403),
        ("no port", "GET / HTTP/1.1", vec![line("Host: 127.0.0.1")], 403),
        ("no host", "GET / HTTP/1.0", vec![secret()], 403),
        ("two hosts", "GET / HTTP/1.1", vec![host(), line("Host: evil.example")], 403),
        (
            "another origin",
            "POST /ask HTTP/1.1",
            vec![host(), secret(), line("Origin: http://evil.example")],
            403,
        ),
        ("no origin", "POST /ask HTTP/1.1", vec![host(), secret(), line("Origin: null")], 403),
        (
            "another port's origin",
            "POST /ask HTTP/1.1",
            vec![host(), secret(), line("Origin: http://127.0.0.1:1")],
            403,
        ),
        (
            "https",
            "POST /ask HTTP/1.1",
            vec![host(), secret(), format!("Origin: https://127.0.0.1:{port}")],
            403,
        ),
        ("another site", "GET / HTTP/1.1", vec![host(), line("Sec-Fetch-Site: cross-site")], 403),
        ("OPTIONS", "OPTIONS /ask HTTP/1.1", vec![host(), secret()], 405),
        ("PUT", "PUT /write HTTP/1.1", vec![host(), secret()], 405),
        ("DELETE", "DELETE / HTTP/1.1", vec![host(), secret()], 405),
        ("GET of what is posted", "GET /write HTTP/1.1", vec![host(), secret()], 405),
        ("POST of what is got", "POST /first HTTP/1.1", vec![host(), secret()], 405),
    ] {
        let reply = served.raw(first, &head, "{}");
        assert_eq!(reply.status, status, "{why}: {}", reply.body);
        assert!(!reply.body.contains("tau"), "{why}");
        assert!(reply.head.contains("cache-control: no-store"), "{why}: {}", reply.head);
        assert!(!reply.head.contains("access-control-"), "{why}");
    }
    let origin = format!("Origin: http://localhost:{port}");
    assert_eq!(served.own("POST /ask HTTP/1.1", &[origin], "{}").status, 200);
    assert_eq!(served.own("POST /ask HTTP/1.1", &[], "{\"do\":\"shell\"}").status, 400);
    assert_eq!(text(&served.model), MODEL);
}

#[test]
fn values_are_written_into_the_model_alone_unless_it_has_changed() {
    let served = Served::new();
    let answer = served.asked("{}");
    assert_eq!(answer["ok"], Value::Bool(true), "{answer}");
    let digest = answer["digest"].as_str().expect("a digest");
    let write = |values: &str, digest: &str| {
        let body = format!("{{\"values\":{values},\"variant\":{{}},\"digest\":\"{digest}\"}}");
        served.own("POST /write HTTP/1.1", &[], &body)
    };
    assert_eq!(write("{\"nothing\":1}", digest).status, 409);
    assert_eq!(write("{\"tau\":\"1; drop\"}", digest).status, 400);
    assert_eq!(text(&served.model), MODEL);
    let reply = write("{\"tau\":150.5}", digest);
    assert_eq!(reply.status, 200, "{}", reply.body);
    let written = MODEL.replace("120 in", "150.5 in");
    assert_eq!(text(&served.model), written);
    let refused = write("{\"tau\":3}", digest);
    assert_eq!(refused.status, 409);
    assert!(refused.body.contains("has changed since it was read"), "{}", refused.body);
    assert_eq!(text(&served.model), written);
}

#[test]
fn a_save_is_told_and_the_next_answer_has_it() {
    let served = Served::new();
    assert_eq!(served.asked("{}")["ok"], Value::Bool(true));
    let head = format!(
        "GET /events HTTP/1.1\r\nHost: {}\r\nX-Dgd-Secret: {}\r\n\r\n",
        served.host(),
        served.secret
    );
    let mut stream = served.send(&head);
    let mut heard = String::new();
    let mut hear = |part: &str| {
        let mut bytes = [0; 1024];
        while !heard.contains(part) {
            let n = stream.read(&mut bytes).expect("an event comes");
            assert!(n > 0, "it ended: {heard}");
            heard.push_str(&String::from_utf8_lossy(&bytes[..n]));
        }
    };
    hear("text/event-stream");
    // File times may have a resolution of milliseconds or worse.
    thread::sleep(Duration::from_millis(250));
    let began = Instant::now();
    fs::write(&served.model, MODEL.replace("= 80", "= 40")).expect("the folder is writable");
    hear("event: saved");
    let answer = served.asked("{}");
    println!("from a save to its answer: {:.0} ms", began.elapsed().as_secs_f64() * 1e3);
    let first = &answer["charts"]["columns"][1][0];
    assert_eq!(first.as_f64(), Some(40.0), "{answer}");
}

#[test]
fn an_effect_that_comes_is_offered() {
    let served = Served::new();
    let effects = served.model.with_file_name("effects");
    fs::create_dir(&effects).expect("the folder is writable");
    let offered = || served.asked("{}")["controls"]["effects"].as_array().map(Vec::len);
    assert_eq!(offered(), Some(0));
    // It is polled every tenth of a second.
    thread::sleep(Duration::from_millis(250));
    let text =
        "effect heat on cooling\nkind plant\nparameter P [K] = 1\nnull P = 0\nadd P to cooling\n";
    fs::write(effects.join("heat.dgd"), text).expect("the folder is writable");
    let began = Instant::now();
    while offered() != Some(1) {
        assert!(began.elapsed() < Duration::from_secs(30), "it is not offered");
        thread::sleep(Duration::from_millis(50));
    }
}

#[test]
fn so_many_pages_listen_and_others_are_told() {
    let served = Served::new();
    let head = format!(
        "GET /events HTTP/1.1\r\nHost: {}\r\nX-Dgd-Secret: {}\r\n\r\n",
        served.host(),
        served.secret
    );
    let first_line = |stream: &mut TcpStream| {
        let mut bytes = [0; 12];
        stream.read_exact(&mut bytes).expect("an answer");
        String::from_utf8_lossy(&bytes).into_owned()
    };
    let mut listening: Vec<TcpStream> =
        (0..limits::LISTENING).map(|_| served.send(&head)).collect();
    for stream in &mut listening {
        assert_eq!(first_line(stream), "HTTP/1.1 200");
    }
    assert_eq!(first_line(&mut served.send(&head)), "HTTP/1.1 503");
    // When one goes away, another may come.
    listening.pop();
    let began = Instant::now();
    while first_line(&mut served.send(&head)) != "HTTP/1.1 200" {
        assert!(began.elapsed() < Duration::from_secs(30), "no place is free");
        thread::sleep(Duration::from_millis(50));
    }
}

#[test]
fn more_connections_than_there_are_places_wait_until_silent_ones_are_closed() {
    let served = Served::new();
    let silent: Vec<TcpStream> = (0..limits::CONNECTIONS).map(|_| served.send("")).collect();
    let began = Instant::now();
    let host = format!("Host: {}", served.host());
    assert_eq!(served.raw("GET / HTTP/1.1", &[host], "").status, 200);
    assert!(began.elapsed() > Duration::from_secs(5), "they had no places: {:?}", began.elapsed());
    drop(silent);
}
