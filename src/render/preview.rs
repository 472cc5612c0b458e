//! The growing picture in tev, the viewer of Thomas Müller, by its protocol over TCP.

use std::io::{self, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::sync::Mutex;
use std::time::Duration;

use crate::film::Window;

/// Where tev listens unless told otherwise.
const DEFAULT_PORT: u16 = 14_158;

/// How long to wait for an answer, and for tev to take a tile.
const PATIENCE: Duration = Duration::from_secs(2);

/// The packets' kinds.
const CREATE_IMAGE: u8 = 4;
const UPDATE_IMAGE: u8 = 6;

/// The channels shown.
const CHANNELS: [&str; COUNT as usize] = ["R", "G", "B", "A"];
const COUNT: u32 = 4;

/// A picture shown by a tev that listens.
#[derive(Debug)]
pub struct TevPreview {
    name: String,
    /// None once tev has gone away.
    stream: Mutex<Option<TcpStream>>,
}

impl TevPreview {
    /// Opens a picture of `size` pixels in the tev at `address`, `host` or `host:port`.
    ///
    /// # Errors
    /// If none listens there.
    pub fn open(address: &str, name: &str, size: [u32; 2]) -> io::Result<Self> {
        let address =
            if address.contains(':') { address.to_owned() } else { format!("{address}:{DEFAULT_PORT}") };
        let mut last = io::Error::new(io::ErrorKind::NotFound, "no such host");
        for place in address.to_socket_addrs()? {
            match TcpStream::connect_timeout(&place, PATIENCE) {
                Ok(mut stream) => {
                    stream.set_write_timeout(Some(PATIENCE))?;
                    stream.write_all(&creation(name, size))?;
                    return Ok(Self { name: name.to_owned(), stream: Mutex::new(Some(stream)) });
                }
                Err(error) => last = error,
            }
        }
        Err(last)
    }

    /// Shows a tile of the picture, given as all channels of each pixel in turn, R, G, B and A first. A tev that has gone
    /// away is no error: the render goes on.
    pub(super) fn show(&self, tile: Window, pixels: &[f32]) {
        let packet = update(&self.name, tile, pixels);
        let mut stream = self.stream.lock().expect("another thread's panic ends the render");
        if stream.as_mut().is_some_and(|stream| stream.write_all(&packet).is_err()) {
            *stream = None;
        }
    }
}

/// A packet: its length with these four bytes, its kind, its content.
fn packet(kind: u8, content: &[u8]) -> Vec<u8> {
    let length = u32::try_from(content.len() + 5).expect("a tile is small");
    [&length.to_le_bytes(), &[kind][..], content].concat()
}

/// Whether to come to the front, the picture's name.
fn start(to_front: bool, name: &str) -> Vec<u8> {
    let mut content = vec![u8::from(to_front)];
    push_text(&mut content, name);
    content
}

fn push_text(content: &mut Vec<u8>, text: &str) {
    content.extend(text.bytes().filter(|&byte| byte != 0));
    content.push(0);
}

fn push_channels(content: &mut Vec<u8>) {
    content.extend(COUNT.to_le_bytes());
    CHANNELS.into_iter().for_each(|channel| push_text(content, channel));
}

fn creation(name: &str, size: [u32; 2]) -> Vec<u8> {
    let mut content = start(true, name);
    content.extend(size.into_iter().flat_map(u32::to_le_bytes));
    push_channels(&mut content);
    packet(CREATE_IMAGE, &content)
}

fn update(name: &str, tile: Window, pixels: &[f32]) -> Vec<u8> {
    let mut content = start(false, name);
    push_channels(&mut content);
    content.extend([tile.x, tile.y, tile.width, tile.height].into_iter().flat_map(u32::to_le_bytes));
    // where each channel's numbers start, and how far apart they are
    let count = tile.pixels();
    content.extend((0..CHANNELS.len()).flat_map(|channel| ((channel * count) as u64).to_le_bytes()));
    content.extend(CHANNELS.iter().flat_map(|_| 1_u64.to_le_bytes()));
    let stride = pixels.len() / count;
    for channel in 0..CHANNELS.len() {
        content.extend(pixels.iter().skip(channel).step_by(stride).flat_map(|value| value.to_le_bytes()));
    }
    packet(UPDATE_IMAGE, &content)
}

#[cfg(test)]
mod tests {
    use std::io::Read;
    use std::net::TcpListener;

    use super::*;

    #[test]
    fn tiles_reach_a_listener() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap().to_string();
        let received = std::thread::spawn(move || {
            let mut bytes = Vec::new();
            listener.accept().unwrap().0.read_to_end(&mut bytes).unwrap();
            bytes
        });
        let preview = TevPreview::open(&address, "a", [4, 2]).unwrap();
        // two pixels of R, G, B, A and one more channel
        let pixels: Vec<_> = (0..10_u8).map(f32::from).collect();
        preview.show(Window { x: 2, y: 1, width: 2, height: 1 }, &pixels);
        drop(preview);
        let bytes = received.join().unwrap();
        let head = b"\x1c\0\0\0\x04\x01a\0\x04\0\0\0\x02\0\0\0\x04\0\0\0R\0G\0B\0A\0";
        assert_eq!(bytes[..28], head[..]);
        let tile = &bytes[28..];
        assert_eq!(tile[..5], [u8::try_from(tile.len()).unwrap(), 0, 0, 0, UPDATE_IMAGE]);
        let values: Vec<_> =
            tile[tile.len() - 32..].chunks(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect();
        assert_eq!(values, [0.0, 5.0, 1.0, 6.0, 2.0, 7.0, 3.0, 8.0]);
    }

    #[test]
    fn nobody_listening_is_an_error() {
        let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
        assert!(TevPreview::open(&format!("127.0.0.1:{port}"), "a", [1, 1]).is_err());
    }
}
