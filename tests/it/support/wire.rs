//! Connections written and read by hand, for callers that do not keep to the rules.

use std::{net::SocketAddr, time::Duration};

use tokio::{
    io::{AsyncReadExt, AsyncWriteExt},
    net::TcpStream,
};

/// What begins every HTTP/2 connection.
pub const PREFACE: &[u8] = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n";

/// Kinds of HTTP/2 frames.
pub const HEADERS: u8 = 1;
pub const RESET: u8 = 3;
pub const SETTINGS: u8 = 4;
pub const PING: u8 = 6;

/// Long enough for whatever must happen at all.
const LONG: Duration = Duration::from_secs(20);

/// A connection on which `bytes` are sent.
pub async fn connect(address: SocketAddr, bytes: &[u8]) -> TcpStream {
    let mut stream = TcpStream::connect(address).await.unwrap();
    stream.write_all(bytes).await.unwrap();
    stream
}

/// What comes until the connection is closed, which must happen.
pub async fn read_to_close(stream: &mut TcpStream) -> Vec<u8> {
    let mut bytes = Vec::new();
    // a reset is an end as well
    let _ = tokio::time::timeout(LONG, stream.read_to_end(&mut bytes)).await.expect("no end");
    bytes
}

/// Whether the connection is open and nothing more comes on it.
pub fn is_open(stream: &TcpStream) -> bool {
    let read = stream.try_read(&mut [0; 1]);
    read.is_err_and(|error| error.kind() == std::io::ErrorKind::WouldBlock)
}

/// The answer's status to a request of HTTP/1 that is sent whole.
pub async fn status(address: SocketAddr, request: &[u8]) -> (u16, String) {
    let mut stream = connect(address, request).await;
    let mut text = String::new();
    let mut buffer = vec![0; 1 << 16];
    while !text.contains("\r\n\r\n") {
        let read = stream.read(&mut buffer);
        let length = tokio::time::timeout(LONG, read).await.expect("no answer").unwrap_or(0);
        if length == 0 {
            break;
        }
        text.push_str(&String::from_utf8_lossy(&buffer[..length]));
    }
    let status = text.split(' ').nth(1).and_then(|status| status.parse().ok());
    (status.unwrap_or_default(), text)
}

/// A frame of HTTP/2.
pub fn frame(kind: u8, flags: u8, stream: u32, payload: &[u8]) -> Vec<u8> {
    let mut frame = u32::try_from(payload.len()).unwrap().to_be_bytes()[1..].to_vec();
    frame.extend([kind, flags]);
    frame.extend(stream.to_be_bytes());
    frame.extend(payload);
    frame
}

/// The beginning of a connection whose streams may send `window` bytes each.
pub fn preface(window: u32) -> Vec<u8> {
    let mut setting = vec![0, 4];
    setting.extend(window.to_be_bytes());
    [PREFACE, &frame(SETTINGS, 0, 0, &setting)].concat()
}

/// A whole request on `stream`.
pub fn request(stream: u32, method: &str, path: &str, more: &[(&str, &str)]) -> Vec<u8> {
    let first = [(":method", method), (":scheme", "http"), (":path", path), (":authority", "a")];
    let mut block = Vec::new();
    for (name, value) in first.iter().chain(more) {
        block.push(0);
        for text in [name, value] {
            block.push(u8::try_from(text.len()).unwrap());
            block.extend(text.as_bytes());
        }
    }
    frame(HEADERS, 5, stream, &block)
}

/// The frames that come until `enough` says so of their kinds and streams, or the connection is closed.
/// Pings are answered.
pub async fn frames(
    stream: &mut TcpStream,
    enough: impl Fn(&[(u8, u32)]) -> bool,
) -> Vec<(u8, u32)> {
    let mut seen = Vec::new();
    let read = async {
        let mut head = [0; 9];
        while !enough(&seen) && stream.read_exact(&mut head).await.is_ok() {
            let length = u32::from_be_bytes([0, head[0], head[1], head[2]]);
            let mut payload = vec![0; length as usize];
            if stream.read_exact(&mut payload).await.is_err() {
                break;
            }
            if head[3] == PING && head[4] & 1 == 0 {
                let _ = stream.write_all(&frame(PING, 1, 0, &payload)).await;
            }
            seen.push((head[3], u32::from_be_bytes([head[5], head[6], head[7], head[8]])));
        }
    };
    tokio::time::timeout(LONG, read).await.expect("no end");
    seen
}
