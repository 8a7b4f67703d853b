//! HTTP/1.1 between a browser and this server: one request for each connection.
//!
//! In: a connection. Out: a [`Request`], or the status and the reason of its [`Refusal`]; a response. Invariant: nothing is
//! read beyond the limits, and no memory is reserved for what a request merely announces; a page of another origin, also
//! under a name that leads to this machine, is refused.

use httparse::Status;
use std::io::{ErrorKind, Read, Result, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

pub(super) const HTML: &str = "text/html; charset=utf-8";
pub(super) const JSON: &str = "application/json";

/// The largest head of a request, and the most headers in it.
const MOST_HEAD: usize = 16 * 1024;
const MOST_HEADERS: usize = 64;

/// The largest body: the text of a program as JSON.
const MOST_BODY: usize = 1024 * 1024;

/// The time in which a request must be complete.
const PATIENCE: Duration = Duration::from_secs(5);

/// The time for the answer to a connection for which there is no place.
const BRIEF: Duration = Duration::from_millis(20);

/// What the page may load: its own style, the code with this nonce, functions that it makes, and answers of this server.
fn policy(nonce: &str) -> String {
    format!(
        "default-src 'none'; script-src 'nonce-{nonce}' blob:; style-src 'unsafe-inline'; img-src data: blob:; \
         connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    )
}

/// A request.
pub(super) struct Request {
    pub(super) method: String,
    pub(super) path: String,
    pub(super) body: Vec<u8>,
}

/// A request that is not answered.
#[derive(Debug, PartialEq)]
pub(super) struct Refusal {
    pub(super) status: u16,
    pub(super) reason: String,
}

impl Refusal {
    pub(super) fn new(status: u16, reason: String) -> Self {
        Self { status, reason }
    }
}

/// The method, the path, and the number of bytes of the body.
type Head = (String, String, usize);

/// Reads a request to the server at a port.
pub(super) fn read(mut stream: &TcpStream, port: u16) -> std::result::Result<Request, Refusal> {
    let lost = |_| Refusal::new(408, "the request is not complete".to_owned());
    stream.set_write_timeout(Some(PATIENCE)).map_err(lost)?;
    let end = Instant::now() + PATIENCE;
    let mut bytes = Vec::new();
    let mut piece = [0; 4096];
    // The head and the body share one time, so that single bytes in long intervals do not hold a connection.
    let mut more = |bytes: &mut Vec<u8>| {
        let left = end.saturating_duration_since(Instant::now()).max(Duration::from_millis(1));
        stream.set_read_timeout(Some(left)).map_err(lost)?;
        let count = stream.read(&mut piece).map_err(lost)?;
        bytes.extend_from_slice(&piece[..count]);
        match count {
            0 => Err(Refusal::new(400, "the request is not complete".to_owned())),
            _ if Instant::now() >= end => Err(Refusal::new(408, "the request is not complete".to_owned())),
            _ => Ok(()),
        }
    };
    loop {
        more(&mut bytes)?;
        let Some((length, (method, path, announced))) = head(&bytes, port)? else {
            if bytes.len() > MOST_HEAD {
                return Err(Refusal::new(431, format!("the head is longer than {MOST_HEAD} bytes")));
            }
            continue;
        };
        let mut body = bytes.split_off(length);
        while body.len() < announced {
            more(&mut body)?;
        }
        body.truncate(announced);
        return Ok(Request { method, path, body });
    }
}

/// The head of a request and its length; `None` while it is not complete.
fn head(bytes: &[u8], port: u16) -> std::result::Result<Option<(usize, Head)>, Refusal> {
    let mut headers = [httparse::EMPTY_HEADER; MOST_HEADERS];
    let mut parsed = httparse::Request::new(&mut headers);
    let length = match parsed.parse(bytes) {
        Ok(Status::Complete(length)) => length,
        Ok(Status::Partial) => return Ok(None),
        Err(error) => return Err(Refusal::new(400, format!("this is not a request: {error}"))),
    };
    let values = |name: &str| {
        let own = parsed.headers.iter().filter(move |header| header.name.eq_ignore_ascii_case(name));
        own.map(|header| String::from_utf8_lossy(header.value).trim().to_ascii_lowercase())
            .collect::<Vec<_>>()
    };
    let hosts = [format!("127.0.0.1:{port}"), format!("localhost:{port}")];
    let own = |host: &String| hosts.contains(host);
    if !matches!(values("host").as_slice(), [host] if own(host)) {
        return Err(Refusal::new(403, format!("this server answers to http://127.0.0.1:{port}/ only")));
    }
    let is_own = |origin: &String| hosts.iter().any(|host| *origin == format!("http://{host}"));
    if !values("origin").iter().all(is_own) {
        return Err(Refusal::new(403, "a page of another origin asks".to_owned()));
    }
    if !values("transfer-encoding").is_empty() {
        return Err(Refusal::new(411, "the length of the body must be given".to_owned()));
    }
    let announced = match values("content-length").as_slice() {
        [] => 0,
        [one] => one
            .parse::<u64>()
            .map_err(|_| Refusal::new(400, "the length of the body is not a number".to_owned()))?,
        _ => return Err(Refusal::new(400, "the length of the body is given twice".to_owned())),
    };
    if announced > MOST_BODY as u64 {
        return Err(Refusal::new(413, format!("the body is longer than {MOST_BODY} bytes")));
    }
    let (method, path) =
        (parsed.method.unwrap_or_default().to_owned(), parsed.path.unwrap_or_default().to_owned());
    if method == "POST" && !values("content-type").iter().any(|kind| kind.starts_with(JSON)) {
        return Err(Refusal::new(415, format!("the body must be `{JSON}`")));
    }
    Ok(Some((length, (method, path, announced as usize))))
}

/// Whether the other end of a connection, whose request has been read, has closed it.
pub(super) fn is_closed(stream: &TcpStream) -> bool {
    let wait = stream.set_read_timeout(Some(Duration::from_millis(1)));
    match wait.and_then(|()| stream.peek(&mut [0])) {
        Ok(count) => count == 0,
        Err(error) => {
            !matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted)
        }
    }
}

/// Answers a connection for which there is no place, without reading its request.
pub(super) fn turn_away(stream: &TcpStream, nonce: &str, body: &[u8]) -> Result<()> {
    stream.set_write_timeout(Some(BRIEF))?;
    write(stream, nonce, (503, JSON), body)?;
    // What is unread when a connection is closed would reset it, before its answer is read.
    stream.set_read_timeout(Some(BRIEF))?;
    let mut stream = stream;
    stream.read(&mut [0; MOST_HEAD]).map(drop)
}

/// Writes a response and ends the connection.
pub(super) fn write(
    mut stream: &TcpStream,
    nonce: &str,
    (status, kind): (u16, &str),
    body: &[u8],
) -> Result<()> {
    let words = match status {
        200 => "OK",
        403 => "Forbidden",
        404 => "Not Found",
        405 => "Method Not Allowed",
        408 => "Request Timeout",
        411 => "Length Required",
        413 => "Content Too Large",
        415 => "Unsupported Media Type",
        431 => "Request Header Fields Too Large",
        503 => "Service Unavailable",
        504 => "Gateway Timeout",
        500 => "Internal Server Error",
        _ => "Bad Request",
    };
    // A program that takes too long is answered with 504; a server that is busy can be asked again.
    let again = if status == 503 { "Retry-After: 1\r\n" } else { "" };
    let head = format!(
        "HTTP/1.1 {status} {words}\r\n{again}Content-Type: {kind}\r\nContent-Length: {}\r\nConnection: close\r\n\
         Cache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\nReferrer-Policy: no-referrer\r\n\
         Cross-Origin-Resource-Policy: same-origin\r\nContent-Security-Policy: {}\r\n\r\n",
        body.len(),
        policy(nonce)
    );
    stream.write_all(head.as_bytes())?;
    stream.write_all(body)?;
    stream.flush()?;
    stream.shutdown(std::net::Shutdown::Write)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The status of a head; 200 where it is complete and accepted.
    fn status(text: &str) -> u16 {
        match head(text.as_bytes(), 8420) {
            Ok(Some(_)) => 200,
            Ok(None) => 100,
            Err(refusal) => refusal.status,
        }
    }

    #[test]
    fn heads_of_other_pages_and_names_are_refused() {
        let own = "Host: 127.0.0.1:8420\r\n";
        assert_eq!(status(&format!("GET / HTTP/1.1\r\n{own}\r\n")), 200);
        assert_eq!(status(&format!("GET / HTTP/1.1\r\n{own}")), 100);
        assert_eq!(status("GET / HTTP/1.1\r\n\r\n"), 403);
        assert_eq!(status("GET / HTTP/1.1\r\nHost: evil.example:8420\r\n\r\n"), 403);
        assert_eq!(status("GET / HTTP/1.1\r\nHost: 127.0.0.1:8421\r\n\r\n"), 403);
        assert_eq!(status(&format!("GET / HTTP/1.1\r\n{own}Host: evil.example\r\n\r\n")), 403);
        assert_eq!(status(&format!("GET / HTTP/1.1\r\n{own}Origin: null\r\n\r\n")), 403);
        let post = format!("POST /ask HTTP/1.1\r\n{own}Content-Type: application/json\r\n");
        assert_eq!(status(&format!("{post}Origin: http://localhost:8420\r\nContent-Length: 9\r\n\r\n")), 200);
        assert_eq!(status(&format!("{post}Origin: http://evil.example\r\n\r\n")), 403);
        assert_eq!(status(&format!("{post}Content-Length: 104857600\r\n\r\n")), 413);
        assert_eq!(status(&format!("{post}Content-Length: 99999999999999999999\r\n\r\n")), 400);
        assert_eq!(status(&format!("{post}Content-Length: 1\r\nContent-Length: 2\r\n\r\n")), 400);
        assert_eq!(status(&format!("{post}Transfer-Encoding: chunked\r\n\r\n")), 411);
        assert_eq!(status(&format!("POST /ask HTTP/1.1\r\n{own}Content-Type: text/plain\r\n\r\n")), 415);
        assert_eq!(status("\u{1}\u{2}\r\n\r\n"), 400);
    }
}
