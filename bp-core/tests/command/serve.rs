//! `bp serve` and `bp print --interactive`: requests, and the pages in a browser.
//!
//! In: the built binary, programs. Out: statuses, texts and numbers of pages, compared with `bp ask`. Invariant: without
//! node, playwright-core (in `target/browser` or `BVM_NODE_MODULES`) or chromium the tests of pages say that they were
//! skipped.

use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

pub(crate) const RIGHT: &str = "program Shown {
    parameters { rate : probability = 0.3; }
    variables { Rain, Wet : bool; Depth : 0..=9; }
    decomposition { P(Rain) P(Wet | Rain) P(Depth | Rain) }
    forms {
        P(Rain) = bernoulli(rate);
        P(Wet | Rain) = bernoulli(if Rain { 0.9 } else { 0.2 });
        P(Depth | Rain) = weights(if Rain { Depth + 1 } else { 10 - Depth });
    }
    question rain { P(Rain | Depth = 3, Wet = true) }
}
";

/// The word `Wnd` is underlined.
const WRONG: &str = "program Shown { variables { Rain : bool; } decomposition { P(Rain | Wnd) } forms { P(Rain | Wnd) = uniform; } }";

pub(crate) fn example(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples").join(name)
}

/// A server; it ends with this value.
pub(crate) struct Server {
    pub(crate) process: Child,
    pub(crate) port: u16,
}

impl Drop for Server {
    fn drop(&mut self) {
        // One that has ended already needs no end.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

impl Server {
    pub(crate) fn of(file: &Path) -> Self {
        let mut process = Command::new(env!("CARGO_BIN_EXE_bp"))
            .args(["serve", "--port", "0"])
            .arg(file)
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut line = String::new();
        BufReader::new(process.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let port = line.trim().trim_end_matches('/').rsplit(':').next().unwrap().parse().unwrap();
        Self { process, port }
    }

    /// The status and the body of the response to a request as it stands.
    pub(crate) fn raw(&self, head: &str, body: &[u8]) -> (u16, String) {
        let mut stream = TcpStream::connect(("127.0.0.1", self.port)).unwrap();
        let head = head.replace("PORT", &self.port.to_string());
        stream.write_all(head.as_bytes()).unwrap();
        // A server that has refused reads no more.
        let _ = stream.write_all(body);
        let mut bytes = Vec::new();
        let _ = stream.read_to_end(&mut bytes);
        let text = String::from_utf8(bytes).unwrap();
        let status = text.split(' ').nth(1).unwrap_or("0").parse().unwrap();
        (status, text.split_once("\r\n\r\n").map_or("", |(_, body)| body).to_owned())
    }

    pub(crate) fn post(&self, path: &str, body: &Value) -> (u16, Value) {
        let body = body.to_string();
        let head = format!(
            "POST {path} HTTP/1.1\r\nHost: 127.0.0.1:PORT\r\nOrigin: http://127.0.0.1:PORT\r\n\
             Content-Type: application/json\r\nContent-Length: {}\r\n\r\n",
            body.len()
        );
        let (status, found) = self.raw(&head, body.as_bytes());
        (status, serde_json::from_str(&found).unwrap())
    }
}

#[test]
fn hostile_requests_are_refused() {
    let server = Server::of(&example("dice.bp"));
    let get = |path: &str, more: &str| {
        server.raw(&format!("GET {path} HTTP/1.1\r\nHost: 127.0.0.1:PORT\r\n{more}\r\n"), b"").0
    };
    assert_eq!(get("/", ""), 200);
    for path in ["/../../etc/passwd", "/..%2f..%2fetc/passwd", "/page.js", "//etc/passwd", "/compile/"] {
        assert_eq!(get(path, ""), 404, "{path}");
    }
    assert_eq!(get("/ask", ""), 405);
    assert_eq!(get("/", "Origin: http://evil.example\r\n"), 403);
    assert_eq!(server.raw("GET / HTTP/1.1\r\nHost: evil.example:PORT\r\n\r\n", b"").0, 403);
    // The body is not waited for.
    let head = "POST /compile HTTP/1.1\r\nHost: 127.0.0.1:PORT\r\nContent-Type: application/json\r\n\
        Content-Length: 104857600\r\n\r\n";
    assert_eq!(server.raw(head, b"").0, 413);
    assert_eq!(server.raw("nonsense\r\n\r\n", b"").0, 400);
    let long = format!("GET /{} HTTP/1.1\r\n", "x".repeat(40_000));
    assert_eq!(server.raw(&long, b"").0, 431);
    let (status, found) = server.post("/compile", &json!({ "words": 1 }));
    assert_eq!((status, found["error"].as_str()), (400, Some("the request is not understood")));
    // It still answers.
    assert_eq!(get("/", ""), 200);
    let again =
        Command::new(env!("CARGO_BIN_EXE_bp")).args(["serve", "--port", &server.port.to_string()]).output();
    let again = again.unwrap();
    let message = String::from_utf8(again.stderr).unwrap();
    assert_eq!(again.status.code(), Some(1), "{message}");
    assert!(
        message.contains(&format!("port {} is in use; choose another with `--port`", server.port)),
        "{message}"
    );
}

#[test]
fn programs_that_explode_are_answered_with_a_reason() {
    let server = Server::of(&example("dice.bp"));
    let large = "program Large { variables { A, B, C : 0..=99999; } decomposition { P(A) P(B) P(C | A B) }
        forms { P(A) = uniform; P(B) = uniform; P(C | A B) = normal(A * B, 3); } question c { P(C | A) } }";
    let deep = format!("program Deep {{ {} }}", "(".repeat(100_000));
    for text in [large.to_owned(), deep] {
        let (status, found) = server.post("/compile", &json!({ "text": text }));
        let refused = found["program"]["questions"][0]["refused"].as_str();
        let mistake = found["mistakes"][0]["message"].as_str();
        let limit = found["error"].as_str();
        let reason = refused.or(mistake).or(limit).unwrap_or_else(|| panic!("{status} {found}"));
        assert!(!reason.is_empty() && (status == 200 || status == 504), "{status} {reason}");
    }
    let (_, found) = server.post("/compile", &json!({ "text": "program É { variables { \"é𝛼\" : bol; } }" }));
    // Units of UTF-16 before `bol`: the 𝛼 counts twice.
    assert_eq!(
        found["mistakes"][0]["start"],
        json!("program É { variables { \"é𝛼\" : ".encode_utf16().count()),
        "{found}"
    );
}

/// A program that no page computes: `F`, which is observed, is flat.
fn line(parameters: &str, spread: &str, question: &str) -> String {
    format!(
        "program Line {{ {parameters} variables {{ X, Y, F : real; }} decomposition {{ P(F) P(X) P(Y | X F) }}
         forms {{ P(F) = flat; P(X) = normal(0, {spread}); P(Y | X F) = normal(X + F, 1); }} question x {{ {question} }} }}"
    )
}

#[test]
fn questions_without_a_function_are_answered_by_the_server() {
    let server = Server::of(&example("dice.bp"));
    let text = line("parameters { spread : real = 2; }", "spread", "P(X | Y = 1, F = 0)");
    let (status, found) = server.post("/compile", &json!({ "text": text }));
    let question = &found["program"]["questions"][0];
    assert!(status == 200 && question["refused"].is_string(), "{found}");
    let names: Vec<&str> =
        question["controls"].as_array().unwrap().iter().map(|one| one["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["Y", "F", "spread"]);
    // Precision 1/s² + 1: the mean is y s² / (1 + s²), 2.7 for y = 3 and s = 3.
    let (_, answers) = server
        .post("/ask", &json!({ "text": text, "question": 0, "values": { "Y": 3, "F": 0, "spread": 3 } }));
    let mean = answers[0]["rows"][0]["figure"]["mean"].as_f64().unwrap();
    assert!((mean - 2.7).abs() < 1e-12, "{answers}");
    let (_, answers) = server.post("/ask", &json!({ "text": text, "question": 7 }));
    assert_eq!(answers[0]["error"], "there is no such question");
}

/// What the script finds on a page; `None` where a program of the test is missing.
fn used(address: &str, texts: &[&str]) -> Option<Value> {
    browsed("page.cjs", address, texts)
}

/// What a script finds on a page; `None` where a program of the test is missing.
pub(crate) fn browsed(script: &str, address: &str, texts: &[&str]) -> Option<Value> {
    let chromium = Path::new("/usr/bin/chromium");
    if !chromium.is_file() {
        println!("skipped: there is no {}", chromium.display());
        return None;
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let modules = std::env::var_os("BVM_NODE_MODULES")
        .map_or_else(|| root.join("../target/browser/node_modules"), PathBuf::from);
    let script = root.join("tests/command/programs").join(script);
    let node = Command::new("node")
        .arg(script)
        .arg(chromium)
        .arg(address)
        .args(texts)
        .env("NODE_PATH", modules)
        .output();
    let Ok(output) = node else {
        println!("skipped: there is no program `node`");
        return None;
    };
    let messages = String::from_utf8_lossy(&output.stderr);
    if messages.contains("MODULE_NOT_FOUND") {
        println!("skipped: `node` lacks playwright-core");
        return None;
    }
    assert!(output.status.success(), "{messages}");
    Some(serde_json::from_slice(&output.stdout).unwrap())
}

/// The probabilities that `bp ask` prints, in a table of one variable.
fn asked(file: &Path, question: &str) -> Vec<f64> {
    let output = Command::new(env!("CARGO_BIN_EXE_bp"))
        .arg("ask")
        .arg(file)
        .args([question, "--json"])
        .output()
        .unwrap();
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    found["answer"].as_array().unwrap().iter().map(|row| row["p"].as_f64().unwrap()).collect()
}

/// The numbers of the rows on a page, which have six digits.
fn numbers(rows: &Value) -> Vec<f64> {
    rows.as_array()
        .unwrap()
        .iter()
        .map(|row| row[row.as_array().unwrap().len() - 1].as_str().unwrap().parse().unwrap())
        .collect()
}

#[track_caller]
fn are_near(found: &[f64], expected: &[f64]) {
    assert_eq!(found.len(), expected.len());
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() <= 1e-6 * expected.abs(), "{found}, not {expected}");
    }
}

/// What holds of each page.
#[track_caller]
fn is_sound(found: &Value) {
    assert_eq!(found["errors"], json!([]));
    assert_eq!(found["reached"], true, "the keyboard reaches the first control");
    assert!(found["derivation"].as_u64().unwrap() > 1 && found["figure"].as_u64().unwrap() > 1, "{found}");
    assert_eq!(found["overflow"], 0, "on a small screen the page scrolls down only");
    for scheme in ["light", "dark"] {
        match &found["faults"][scheme] {
            Value::Null => println!("skipped: without axe-core the rules of accessibility are not checked"),
            faults => assert_eq!(*faults, json!([]), "{scheme}"),
        }
    }
    let times = found["milliseconds"].as_array().map_or(&[][..], Vec::as_slice);
    let mut times: Vec<f64> = times.iter().map(|one| one.as_f64().unwrap()).collect();
    times.sort_by(f64::total_cmp);
    if let Some(median) = times.get(times.len() / 2) {
        println!(
            "an answer takes {median} ms (median of {}), at most {} ms",
            times.len(),
            times[times.len() - 1]
        );
        assert!(*median < 16.0, "an answer within a frame: {times:?}");
    }
}

#[test]
fn the_served_page_shows_mistakes_and_answers_in_a_browser() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("shown.bp");
    std::fs::write(&file, RIGHT).unwrap();
    let server = Server::of(&example("dice.bp"));
    let address = format!("http://127.0.0.1:{}/", server.port);
    let Some(found) = used(&address, &[WRONG, RIGHT]) else { return };
    is_sound(&found);
    let own = |url: &Value| {
        url.as_str().is_some_and(|url| {
            url.starts_with(&address) || url.starts_with("blob:") || url.starts_with("data:")
        })
    };
    assert!(found["requests"].as_array().unwrap().iter().all(own), "{found}");
    assert_eq!(found["underlined"], "Wnd");
    assert!(found["mistake"].as_str().unwrap().starts_with("Line 1: "), "{found}");
    assert_eq!((&found["linked"], &found["download"]), (&json!(RIGHT), &json!(RIGHT)));
    are_near(&numbers(&found["first"]), &asked(&file, "P(Rain | Depth = 3, Wet = true)"));
    assert_eq!(found["told"], "4", "a step of the slider");
    are_near(&numbers(&found["moved"]), &asked(&file, "P(Rain | Depth = 4, Wet = true)"));
    // 0.3 · 0.9 + 0.7 · 0.2.
    are_near(&numbers(&found["asked"]), &[0.59, 0.41]);
}

/// The page of a file, in the folder.
pub(crate) fn exported(file: &Path, question: &[&str], folder: &Path) -> PathBuf {
    let page = folder.join("page.html");
    let output = Command::new(env!("CARGO_BIN_EXE_bp"))
        .arg("print")
        .arg(file)
        .args(question)
        .args(["--interactive", "--out"])
        .arg(&page)
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    page
}

#[test]
fn answers_belong_to_the_program_that_is_shown() {
    let folder = tempfile::tempdir().unwrap();
    let line = |spread: &str| line("", spread, "P(X | Y = 1, F = 0)");
    let file = folder.path().join("line.bp");
    std::fs::write(&file, line("2")).unwrap();
    let server = Server::of(&file);
    let address = format!("http://127.0.0.1:{}/", server.port);
    let Some(found) = browsed("late.cjs", &address, &[&line("3")]) else { return };
    assert_eq!(found["errors"], json!([]));
    assert_eq!(found["file"], "line.bp");
    // The mean is y s² / (1 + s²): 0.8 for s = 2, 0.9 for s = 3, and 1.8 for s = 3 and y = 2; the variance is s² / (1 + s²).
    assert_eq!(found["first"], "0.800000 ± 0.894427");
    assert_eq!(found["waiting"], "Computing …");
    assert_eq!(found["edited"], "0.900000 ± 0.948683");
    assert_eq!(found["late"], found["edited"], "the answer of the earlier program came later");
    assert_eq!(found["moved"], "1.80000 ± 0.948683");
    assert_eq!(
        found["kept"],
        json!(["2", "1.60000 ± 0.894427"]),
        "the evidence stays when the program changes"
    );
    assert_eq!(found["empty"], "This is not a number; the answer is that of 2.");
    assert_eq!(found["busy"], "1.80000 ± 0.948683", "a busy server is asked again");
    assert!(found["damaged"].as_str().unwrap().starts_with("The link is damaged"), "{found}");
}

#[test]
fn an_exported_page_says_why_it_has_no_controls() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("line.bp");
    let text = line("", "2", "P(X | Y F)");
    std::fs::write(&file, text).unwrap();
    let page = std::fs::read_to_string(exported(&file, &[], folder.path())).unwrap();
    let (_, rest) = page.split_once("id=\"data\">").unwrap();
    let data: Value = serde_json::from_str(rest.split_once("</script>").unwrap().0).unwrap();
    let question = &data["questions"][0];
    let refused = question["refused"].as_str().unwrap();
    assert!(refused.contains("`flat` is neither `normal` nor `dirac`"), "{refused}");
    // Y is 0 at first: the mean is 0, the variance 4/5.
    let figure = &question["fixed"][0]["rows"][0]["figure"];
    assert!(figure["mean"].as_f64().unwrap().abs() < 1e-12, "{question}");
    assert!((figure["deviation"].as_f64().unwrap() - 0.8f64.sqrt()).abs() < 1e-12, "{question}");
}

#[test]
fn an_exported_page_works_alone() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("shown.bp");
    std::fs::write(&file, RIGHT).unwrap();
    let page = exported(&file, &[], folder.path());
    let text = std::fs::read_to_string(&page).unwrap();
    assert!(text.len() < 200_000, "{} bytes", text.len());
    let Some(found) = used(&format!("file://{}", page.display()), &[]) else { return };
    is_sound(&found);
    let local = |url: &Value| {
        ["file:", "data:", "blob:"].iter().any(|scheme| url.as_str().unwrap().starts_with(scheme))
    };
    assert!(found["requests"].as_array().unwrap().iter().all(local), "{found}");
    are_near(&numbers(&found["first"]), &asked(&file, "P(Rain | Depth = 3, Wet = true)"));
    are_near(&numbers(&found["moved"]), &asked(&file, "P(Rain | Depth = 4, Wet = true)"));
    assert_eq!(found["download"], json!(RIGHT));
}

#[test]
fn the_boat_and_the_alarm_follow_within_a_frame() {
    let folder = tempfile::tempdir().unwrap();
    // ALARM has 37 variables (Beinlich et al. 1989).
    let alarm = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data/networks/alarm.bif");
    let asked = "P(HYPOVOLEMIA | HRBP = HIGH, BP = LOW, CVP = LOW, PRESS = HIGH)";
    for (file, question) in [(example("boat.bp"), "all"), (alarm, asked)] {
        if !file.is_file() {
            println!("skipped: there is no {}", file.display());
            continue;
        }
        let page = exported(&file, &[question], folder.path());
        let size = std::fs::metadata(&page).unwrap().len();
        println!("{}: {size} bytes", file.display());
        assert!(size < 1_000_000);
        let Some(found) = used(&format!("file://{}", page.display()), &[]) else { return };
        assert!(found["milliseconds"].is_array(), "{found}");
        is_sound(&found);
    }
}
