//! The serial port as a TCP port on this machine.

use std::collections::VecDeque;
use std::net::{TcpListener, TcpStream};
use std::os::fd::{AsFd, BorrowedFd};

use super::{Endpoint, listen, read_some, write_all};

/// A listener and its present client.
#[derive(Debug)]
pub struct Tcp {
    listener: TcpListener,
    client: Option<TcpStream>,
}

impl Tcp {
    /// Listens on 127.0.0.1; port 0 takes a free one.
    ///
    /// # Errors
    /// If the port is taken.
    pub fn listen(port: u16) -> anyhow::Result<Self> {
        Ok(Self {
            listener: listen("--tcp", port)?,
            client: None,
        })
    }

    /// Returns the port's number.
    ///
    /// # Errors
    /// If the system does not report it.
    pub fn port(&self) -> anyhow::Result<u16> {
        Ok(self.listener.local_addr()?.port())
    }

    fn accept(&mut self) {
        // A client that has left again, or cannot be set up, does not count.
        if let Ok((client, _)) = self.listener.accept()
            && client.set_nonblocking(true).is_ok()
        {
            let _ = client.set_nodelay(true);
            self.client = Some(client);
        }
    }
}

impl Endpoint for Tcp {
    fn held(&mut self) -> bool {
        self.client.is_some()
    }

    fn offered(&mut self) -> bool {
        if self.client.is_none() {
            self.accept();
        }
        self.client.is_some()
    }

    fn read(&mut self, to: &mut VecDeque<u8>) {
        if self
            .client
            .as_ref()
            .is_some_and(|client| !read_some(client, to))
        {
            self.client = None;
        }
    }

    fn write(&mut self, from: &mut VecDeque<u8>) {
        if self
            .client
            .as_ref()
            .is_some_and(|client| !write_all(client, from))
        {
            self.client = None;
        }
    }

    fn writable(&self) -> Option<BorrowedFd<'_>> {
        self.client.as_ref().map(AsFd::as_fd)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{Read, Write};
    use std::net::Ipv4Addr;

    #[test]
    fn bytes_go_both_ways_and_a_hangup_is_noticed() {
        let mut tcp = Tcp::listen(0).unwrap();
        assert!(!tcp.offered());
        let mut client = TcpStream::connect((Ipv4Addr::LOCALHOST, tcp.port().unwrap())).unwrap();
        while !tcp.offered() {}
        client.write_all(b"in").unwrap();
        let mut got = VecDeque::new();
        while got.len() < 2 {
            tcp.read(&mut got);
        }
        tcp.write(&mut VecDeque::from(b"out".to_vec()));
        let mut answer = [0; 3];
        client.read_exact(&mut answer).unwrap();
        assert_eq!((got, &answer), (VecDeque::from(b"in".to_vec()), b"out"));
        drop(client);
        while tcp.held() {
            tcp.read(&mut VecDeque::new());
        }
    }
}
