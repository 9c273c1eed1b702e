//! `--display`: what a viewer is sent is the image; without a viewer there is a warning and the same image.

use std::{
    io::Read,
    net::TcpListener,
    thread::{self, JoinHandle},
};

use crate::{Run, code, pixels, refused, stderr};

/// Reads tev's packets one after the other: each begins with its length and its kind.
struct Packet<'a>(&'a [u8]);

impl<'a> Packet<'a> {
    fn split(stream: &'a [u8]) -> (Self, &'a [u8]) {
        let length = u32::from_le_bytes(stream[..4].try_into().unwrap()) as usize;
        let (packet, rest) = stream.split_at(length);
        (Self(&packet[4..]), rest)
    }

    fn bytes(&mut self, n: usize) -> &'a [u8] {
        let (bytes, rest) = self.0.split_at(n);
        self.0 = rest;
        bytes
    }

    fn byte(&mut self) -> u8 {
        self.bytes(1)[0]
    }

    fn u32(&mut self) -> u32 {
        u32::from_le_bytes(self.bytes(4).try_into().unwrap())
    }

    fn u64(&mut self) -> u64 {
        u64::from_le_bytes(self.bytes(8).try_into().unwrap())
    }

    fn text(&mut self) -> String {
        let n = self.0.iter().position(|b| *b == 0).unwrap();
        let text = String::from_utf8(self.bytes(n).to_vec()).unwrap();
        self.byte();
        text
    }
}

const CREATE: u8 = 4;
const UPDATE: u8 = 6;

/// A viewer that takes one connection and remembers all it hears.
fn viewer() -> (String, JoinHandle<Vec<u8>>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    let heard = thread::spawn(move || {
        let mut bytes = Vec::new();
        listener.accept().unwrap().0.read_to_end(&mut bytes).unwrap();
        bytes
    });
    (address, heard)
}

#[test]
fn a_viewer_is_shown_the_image() {
    let run = Run::new();
    let (address, heard) = viewer();
    let file = run.image("a.exr", &["-q", "-i", "path", "--spp", "5", "--display", &address]);
    let stream = heard.join().unwrap();

    let (mut created, mut rest) = Packet::split(&stream);
    assert_eq!((created.byte(), created.byte()), (CREATE, 1));
    let name = created.text();
    assert_eq!(name, "cornell-box, path (pathspace)");
    assert_eq!([created.u32(), created.u32(), created.u32()], [16, 12, 3]);
    assert_eq!([created.text(), created.text(), created.text()], ["R", "G", "B"]);

    let (mut shown, mut updates) = (Vec::new(), 0);
    while !rest.is_empty() {
        updates += 1;
        let (mut update, next) = Packet::split(rest);
        rest = next;
        assert_eq!((update.byte(), update.byte(), update.text()), (UPDATE, 0, name.clone()));
        assert_eq!(
            (update.u32(), update.text(), update.text(), update.text()),
            (3, "R".into(), "G".into(), "B".into())
        );
        assert_eq!([0; 4].map(|_| update.u32()), [0, 0, 16, 12]);
        assert_eq!([0; 6].map(|_| update.u64()), [0, 1, 2, 3, 3, 3]);
        shown = update.0.chunks(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect();
    }
    let image: Vec<_> = pixels(&file).pixels.iter().flat_map(|p| p.to_array()).collect();
    assert!(shown == image, "the last update is the file's image");

    // One pass is one image, and a shard without samples is none.
    let sent = |options: &[&str]| {
        let (address, heard) = viewer();
        run.image("a.exr", &[&["-q", "-i", "path", "--display", &address], options].concat());
        heard.join().unwrap()
    };
    let one = sent(&["--spp", "1"]);
    assert_eq!(one.len() - created_length(&one), (stream.len() - created_length(&stream)) / updates);
    assert!(sent(&["--spp", "1", "--shard", "1/2"]).is_empty());
}

/// Bytes of the first packet.
fn created_length(stream: &[u8]) -> usize {
    u32::from_le_bytes(stream[..4].try_into().unwrap()) as usize
}

#[test]
fn nobody_needs_to_watch() {
    let run = Run::new();
    let address = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().to_string();
    let output = run.render(&["-i", "path", "--spp", "2", "-o", "a.png", "--display", &address]);
    assert_eq!(code(&output), 0);
    let said = stderr(&output);
    assert!(said.contains(&format!("warning: no viewer at {address}")), "{said}");
    assert_eq!(run.files(), ["a.png"]);
    for wrong in ["viewer", ":14158", "localhost:0", "localhost:tev", "localhost:99999"] {
        refused(&run.render(&["--display", wrong, "-o", "a.png"]), 2, "127.0.0.1:14158");
    }
}
