//! The connections of `bp serve`: slow ones, too many, those that are closed; and its end.
//!
//! In: the built binary, bytes in intervals. Out: statuses. Invariant: no connection holds the server longer than its time.

use crate::serve::{RIGHT, Server, example};
use serde_json::json;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::process::Command;
use std::time::{Duration, Instant};

/// The status of what a server writes to a connection; 0 if it writes nothing.
fn status(stream: &mut TcpStream) -> u16 {
    let mut bytes = Vec::new();
    // A connection that is reset may have been answered before.
    let _ = stream.read_to_end(&mut bytes);
    String::from_utf8_lossy(&bytes).split(' ').nth(1).map_or(0, |status| status.parse().unwrap())
}

#[test]
fn single_bytes_in_intervals_do_not_hold_a_connection() {
    let server = Server::of(&example("dice.bp"));
    let start = Instant::now();
    let connect = || TcpStream::connect(("127.0.0.1", server.port)).unwrap();
    let head = format!(
        "POST /ask HTTP/1.1\r\nHost: 127.0.0.1:{}\r\nContent-Type: application/json\r\n\
         Content-Length: 1000\r\n\r\n",
        server.port
    );
    let (mut in_head, mut in_body) = (connect(), connect());
    in_head.write_all(b"GET / HTTP/1.1\r\nX: ").unwrap();
    in_body.write_all(head.as_bytes()).unwrap();
    for stream in [&in_head, &in_body] {
        stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
    }
    // Each byte comes before the time of a silent connection is over.
    while start.elapsed() < Duration::from_secs(7) {
        let _ = in_head.write_all(b"x");
        let _ = in_body.write_all(b"x");
        std::thread::sleep(Duration::from_millis(500));
    }
    let silent = start.elapsed();
    status(&mut in_head);
    status(&mut in_body);
    assert!(start.elapsed() < silent + Duration::from_secs(2), "the connections are still open");
}

#[test]
fn connections_beyond_the_limit_are_told_so() {
    let server = Server::of(&example("dice.bp"));
    let connect = || TcpStream::connect(("127.0.0.1", server.port)).unwrap();
    let idle: Vec<TcpStream> = (0..32).map(|_| connect()).collect();
    let mut beyond = connect();
    assert_eq!(status(&mut beyond), 503);
    drop(idle);
    std::thread::sleep(Duration::from_millis(500));
    assert_eq!(server.raw("GET / HTTP/1.1\r\nHost: 127.0.0.1:PORT\r\n\r\n", b"").0, 200);
}

/// A program whose answer takes seconds: a mixture of 100 000 distributions of 24 reals.
fn slow() -> String {
    let names: Vec<String> = (0..24).map(|place| format!("X{place}")).collect();
    let (mut terms, mut forms) = (String::new(), String::new());
    for place in 1..names.len() {
        let left = format!("P(X{place} | X{})", place - 1);
        forms += &format!("{left} = normal(X{}, 1); ", place - 1);
        terms += &(left + " ");
    }
    format!(
        "program Slow {{ variables {{ B : 0..=99999; {} : real; }} decomposition {{ P(B) P(X0 | B) {terms}}}
         forms {{ P(B) = uniform; P(X0 | B) = normal(B, 1); {forms}}} question x {{ P(X1 | X23 = 1) }} }}",
        names.join(", ")
    )
}

#[test]
fn work_ends_with_its_connection() {
    let server = Server::of(&example("dice.bp"));
    let body = json!({ "text": slow(), "question": 0, "values": { "X23": 1 } }).to_string();
    let head = format!(
        "POST /ask HTTP/1.1\r\nHost: 127.0.0.1:{}\r\nContent-Type: application/json\r\n\
         Content-Length: {}\r\n\r\n",
        server.port,
        body.len()
    );
    let asked = || {
        let mut stream = TcpStream::connect(("127.0.0.1", server.port)).unwrap();
        stream.write_all(format!("{head}{body}").as_bytes()).unwrap();
        stream
    };
    // As many as the server works on at a time.
    let waiting: Vec<TcpStream> = (0..4).map(|_| asked()).collect();
    std::thread::sleep(Duration::from_millis(500));
    let busy = server.post("/compile", &json!({ "text": RIGHT }));
    assert_eq!((busy.0, busy.1["error"].as_str()), (503, Some("the server is busy")));
    drop(waiting);
    std::thread::sleep(Duration::from_millis(700));
    assert_eq!(server.post("/compile", &json!({ "text": RIGHT })).0, 200);
}

#[cfg(unix)]
#[test]
fn ctrl_c_is_no_failure_of_a_server() {
    let mut server = Server::of(&example("dice.bp"));
    let sent = Command::new("kill").args(["-INT", &server.process.id().to_string()]).status().unwrap();
    assert!(sent.success());
    assert_eq!(server.process.wait().unwrap().code(), Some(0));
}
