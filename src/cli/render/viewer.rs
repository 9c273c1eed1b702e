//! `--display`: the image as it comes, in the viewer tev.

use std::{
    io,
    net::{TcpStream, ToSocketAddrs},
    time::{Duration, Instant},
};

use pathspace::{film::Image, render::Renderer};
use tev_client::{PacketCreateImage, PacketUpdateImage, TevClient};

use crate::cli::shared::terminal::Terminal;

/// A viewer that is shown the image now and then. It is company, not an output: one that is not there, or goes away, is
/// a warning, and the render goes on.
pub struct Viewer {
    client: Option<TevClient>,
    /// What the viewer calls the image.
    name: String,
    /// When it was shown which number of passes.
    last: Option<(Instant, u32)>,
}

impl Viewer {
    const CHANNELS: [&str; 3] = ["R", "G", "B"];
    /// Between two updates. Each costs an image of the film and its way over the network.
    const WAIT: Duration = Duration::from_secs(1);
    /// What a viewer may take to answer, or to read what it is sent.
    const PATIENCE: Duration = Duration::from_secs(5);
    /// Of one packet, whose length has 32 bits.
    const PIXELS: usize = 1 << 20;

    /// The viewer at `address`, HOST:PORT, for an image called `name`; nobody if there is no address, or nobody
    /// answers.
    pub fn connect(address: Option<&str>, name: String, terminal: Terminal) -> Self {
        let client = address.and_then(|address| match connect(address) {
            Ok(client) => Some(client),
            Err(error) => {
                terminal.warn(format_args!("no viewer at {address} ({error}); rendering without --display"));
                None
            }
        });
        Self { client, name, last: None }
    }

    /// Shows the image after this pass, unless it was shown a moment ago.
    pub fn after_pass(&mut self, renderer: &Renderer<'_>, terminal: Terminal) {
        if self.client.is_some() && self.last.is_none_or(|(at, _)| at.elapsed() >= Self::WAIT) {
            self.show(renderer, terminal);
        }
    }

    /// Shows the image as it is, if there is one that was not shown yet.
    pub fn show(&mut self, renderer: &Renderer<'_>, terminal: Terminal) {
        let Some(client) = &mut self.client else { return };
        let passes = renderer.passes();
        if passes == 0 || self.last.is_some_and(|(_, shown)| shown == passes) {
            return;
        }
        let image = renderer.film().image(passes);
        if let Err(error) = send(client, &self.name, &image, self.last.is_none()) {
            terminal.warn(format_args!("the viewer is gone ({error}); rendering without --display"));
            self.client = None;
        }
        self.last = Some((Instant::now(), passes));
    }
}

fn connect(address: &str) -> io::Result<TevClient> {
    let mut error = io::Error::new(io::ErrorKind::NotFound, "the name has no address");
    for place in address.to_socket_addrs()? {
        match TcpStream::connect_timeout(&place, Viewer::PATIENCE) {
            Ok(socket) => {
                // A viewer that is stopped must not stop the render.
                socket.set_write_timeout(Some(Viewer::PATIENCE))?;
                return Ok(TevClient::wrap(socket));
            }
            Err(refused) => error = refused,
        }
    }
    Err(error)
}

fn send(client: &mut TevClient, name: &str, image: &Image, first: bool) -> io::Result<()> {
    let Image { width, height, ref pixels } = *image;
    let channel_names = &Viewer::CHANNELS;
    if first {
        client.send(PacketCreateImage { image_name: name, grab_focus: true, width, height, channel_names })?;
    }
    let rows = (Viewer::PIXELS / width as usize).max(1);
    for (strip, pixels) in pixels.chunks(rows * width as usize).enumerate() {
        client.send(PacketUpdateImage {
            image_name: name,
            grab_focus: false,
            channel_names,
            channel_offsets: &[0, 1, 2],
            channel_strides: &[3, 3, 3],
            x: 0,
            y: (strip * rows) as u32,
            width,
            height: pixels.len() as u32 / width,
            data: pixels.iter().flat_map(|p| p.to_array()).collect::<Vec<_>>().as_slice(),
        })?;
    }
    Ok(())
}
