//! `bp serve`: the page of a program with an editor, for a browser on this machine.
//!
//! In: a program, requests of a browser. Out: the page, mistakes, functions, answers. Invariant: it listens on the loopback
//! address alone, answers only to that name and to its own page, and writes no file; the work of a request is done by a
//! process of its own, which ends after a fixed time.

mod http;
mod work;

use crate::failure::Failure;
use crate::{page, program};
use bp_core::compiler::error::Error;
use bp_core::compiler::source::Source;
use http::{Refusal, Request};
use serde_json::json;
use std::hash::{BuildHasher, Hasher, RandomState};
use std::io::{ErrorKind, Read, Write};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::Duration;

/// The largest number of connections at a time.
const MOST_CONNECTIONS: usize = 32;

/// The largest number of processes at a time.
const MOST_WORKERS: usize = 4;

/// The interval between glances at a connection whose answer is computed.
const GLANCE: Duration = Duration::from_millis(50);

/// The program of a page that was opened without one.
const FIRST: &str = include_str!("../new/program.bp");

/// Serve a page with an editor, for a browser on this machine.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  bp serve
  bp serve wet_grass.bp
  bp serve alarm.bif --port 9000

The page shows mistakes under the words while you type, the brace figure, the
network, the derivation, and the answers of the declared questions, which
follow sliders and menus. The address of the page holds the text of the program:
it opens the same text for anyone who runs `bp serve`. Only this machine can
reach the page; nothing is written. Ctrl-C ends the server.")]
pub(crate) struct Arguments {
    /// A program or a network; `-` is stdin. A first program if left out.
    file: Option<PathBuf>,
    /// The port; 0 chooses a free one.
    #[arg(long, default_value_t = 8420)]
    port: u16,
    /// Do the work of one request, on stdin and stdout.
    #[arg(long, hide = true)]
    work: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    if arguments.work {
        return work::run();
    }
    let source = match &arguments.file {
        Some(file) => match program::with_source(file) {
            Ok((_, source)) => source,
            // The editor shows what is wrong.
            Err(Failure::Wrong(_, source)) => source,
            Err(Failure::Data(Error::Program { text, .. })) => *text,
            Err(other) => return Err(other),
        },
        None => Source::new("program", FIRST.replace("TITLE", "Grass").replace("NAME", "grass")),
    };
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, arguments.port)).map_err(|error| {
        let port = arguments.port;
        Failure::Words(match error.kind() {
            ErrorKind::AddrInUse => format!("port {port} is in use; choose another with `--port`"),
            _ => format!("port {port} cannot be opened: {error}; choose another with `--port`"),
        })
    })?;
    let port = listener.local_addr().map_err(Failure::Output)?.port();
    let mut out = std::io::stdout();
    writeln!(out, "http://127.0.0.1:{port}/\nCtrl-C ends the server.")?;
    out.flush()?;
    let nonce = nonce();
    let page = page::with_editor(&source, &nonce);
    let (connections, workers) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let server = Arc::new(Server { port, page, nonce, connections, workers });
    for stream in listener.incoming() {
        // A connection that ended before it was accepted is no failure.
        let Ok(stream) = stream else { continue };
        if server.connections.load(Ordering::Relaxed) >= MOST_CONNECTIONS {
            let body = json!({ "error": "the server has too many connections" }).to_string();
            // One that has gone away needs no answer.
            let _ = http::turn_away(&stream, &server.nonce, body.as_bytes());
            continue;
        }
        server.connections.fetch_add(1, Ordering::Relaxed);
        let server = Arc::clone(&server);
        std::thread::spawn(move || {
            server.answer(&stream);
            server.connections.fetch_sub(1, Ordering::Relaxed);
        });
    }
    Ok(())
}

/// A number that no page can guess; a hasher of the standard library begins with random keys.
fn nonce() -> String {
    let random = || RandomState::new().build_hasher().finish();
    format!("{:016x}{:016x}", random(), random())
}

struct Server {
    port: u16,
    page: String,
    nonce: String,
    connections: AtomicUsize,
    workers: AtomicUsize,
}

impl Server {
    /// Answers the one request of a connection.
    fn answer(&self, stream: &TcpStream) {
        let response = http::read(stream, self.port).and_then(|request| self.response(&request, stream));
        // A browser that has gone away needs no answer.
        let _ = match response {
            Ok((kind, body)) => http::write(stream, &self.nonce, (200, kind), body.as_bytes()),
            Err(Refusal { status, reason }) => {
                let body = json!({ "error": reason }).to_string();
                http::write(stream, &self.nonce, (status, http::JSON), body.as_bytes())
            }
        };
    }

    fn response(&self, request: &Request, stream: &TcpStream) -> Result<(&'static str, String), Refusal> {
        match (request.method.as_str(), request.path.as_str()) {
            ("GET", "/") => Ok((http::HTML, self.page.clone())),
            ("POST", "/compile" | "/ask") => {
                let kind = &request.path[1..];
                self.worked(kind, &request.body, stream).map(|found| (http::JSON, found))
            }
            (_, "/" | "/compile" | "/ask") => {
                Err(Refusal::new(405, format!("`{}` is not possible here", request.method)))
            }
            _ => Err(Refusal::new(404, "there is no such page".to_owned())),
        }
    }

    /// What a process of its own finds for a request of a connection.
    fn worked(&self, kind: &str, body: &[u8], stream: &TcpStream) -> Result<String, Refusal> {
        if self.workers.fetch_add(1, Ordering::Relaxed) >= MOST_WORKERS {
            self.workers.fetch_sub(1, Ordering::Relaxed);
            return Err(Refusal::new(503, "the server is busy".to_owned()));
        }
        let found = process(kind, body, stream);
        self.workers.fetch_sub(1, Ordering::Relaxed);
        found
    }
}

/// Runs this program for one request; the process ends early when the connection is closed.
fn process(kind: &str, body: &[u8], stream: &TcpStream) -> Result<String, Refusal> {
    let failed = |error: std::io::Error| Refusal::new(500, format!("the compiler could not be run: {error}"));
    let mut child = Command::new(std::env::current_exe().map_err(failed)?)
        .args(["serve", "--work"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .map_err(failed)?;
    let mut stdin = child.stdin.take().expect("internal: it is piped");
    // If the process ends early, its status says so.
    let _ = writeln!(stdin, "{kind}").and_then(|()| stdin.write_all(body));
    drop(stdin);
    let mut stdout = child.stdout.take().expect("internal: it is piped");
    let (sender, receiver) = mpsc::channel();
    std::thread::spawn(move || {
        let mut found = String::new();
        let read = stdout.read_to_string(&mut found);
        // Nobody receives it if the connection was closed.
        let _ = sender.send(read.map(|_| found));
    });
    let read = loop {
        match receiver.recv_timeout(GLANCE) {
            Err(RecvTimeoutError::Timeout) if http::is_closed(stream) => {
                // One that has just ended needs no end.
                let _ = child.kill();
                let _ = child.wait();
                return Err(Refusal::new(400, "the connection was closed".to_owned()));
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => break Err(ErrorKind::BrokenPipe.into()),
            Ok(read) => break read,
        }
    };
    let status = child.wait().map_err(failed)?;
    match (read, status.code()) {
        (Ok(found), Some(0)) => Ok(found),
        (_, Some(work::TOO_LONG)) => {
            let seconds = work::LIMIT.as_secs();
            Err(Refusal::new(
                504,
                format!("this program takes longer than {seconds} seconds; `bp ask` has no limit"),
            ))
        }
        (_, Some(work::NOT_UNDERSTOOD)) => Err(Refusal::new(400, "the request is not understood".to_owned())),
        _ => Err(Refusal::new(500, "the compiler stopped; the program may need too much memory".to_owned())),
    }
}
