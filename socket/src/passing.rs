//! Open files that travel with bytes, within one host: how the two ends of a link get the same
//! memory.

use std::collections::VecDeque;
use std::io::{self, IoSlice, IoSliceMut};
use std::mem::MaybeUninit;
use std::os::fd::{BorrowedFd, OwnedFd};

use rustix::net::{
    RecvAncillaryBuffer, RecvAncillaryMessage, RecvFlags, SendAncillaryBuffer,
    SendAncillaryMessage, recvmsg, sendmsg,
};

use crate::stream::{SEND_NOW, Stream};

/// Most files that are received at a time. The kernel closes those beyond it.
const MAX_FILES: usize = 4;

impl Stream {
    /// Sends what the socket takes of `bytes` without waiting, and `file` with the first of them.
    /// Returns how many bytes it took.
    ///
    /// # Errors
    /// [`io::ErrorKind::WouldBlock`] if the socket takes nothing now; [`io::ErrorKind::Unsupported`]
    /// if this is no Unix socket.
    pub fn try_send_with_file(&self, bytes: &[u8], file: BorrowedFd<'_>) -> io::Result<usize> {
        if !matches!(self, Self::Unix(_)) {
            return Err(io::ErrorKind::Unsupported.into());
        }
        let mut space = [MaybeUninit::uninit(); rustix::cmsg_space!(ScmRights(1))];
        let mut control = SendAncillaryBuffer::new(&mut space);
        let files = [file];
        control.push(SendAncillaryMessage::ScmRights(&files));
        Ok(sendmsg(self, &[IoSlice::new(bytes)], &mut control, SEND_NOW)?)
    }

    /// As [`receive`](Self::receive); files that have come with the bytes are added to `files`.
    ///
    /// # Errors
    /// As [`receive`](Self::receive).
    pub fn receive_with_files(
        &self,
        buffer: &mut [u8],
        files: &mut VecDeque<OwnedFd>,
    ) -> io::Result<usize> {
        self.receive_files(buffer, files, RecvFlags::empty())
    }

    /// As [`try_receive`](Self::try_receive); files that have come with the bytes are added to
    /// `files`.
    ///
    /// # Errors
    /// As [`try_receive`](Self::try_receive).
    pub fn try_receive_with_files(
        &self,
        buffer: &mut [u8],
        files: &mut VecDeque<OwnedFd>,
    ) -> io::Result<usize> {
        self.receive_files(buffer, files, RecvFlags::DONTWAIT)
    }

    fn receive_files(
        &self,
        buffer: &mut [u8],
        files: &mut VecDeque<OwnedFd>,
        flags: RecvFlags,
    ) -> io::Result<usize> {
        let mut space = [MaybeUninit::uninit(); rustix::cmsg_space!(ScmRights(MAX_FILES))];
        let mut control = RecvAncillaryBuffer::new(&mut space);
        let mut buffers = [IoSliceMut::new(buffer)];
        let received = recvmsg(self, &mut buffers, &mut control, flags | RecvFlags::CMSG_CLOEXEC)?;
        for message in control.drain() {
            if let RecvAncillaryMessage::ScmRights(received) = message {
                files.extend(received);
            }
        }
        Ok(received.bytes)
    }
}

#[cfg(test)]
mod tests {
    use std::fs::File;
    use std::io::{Read, Write};
    use std::os::fd::AsFd;
    use std::os::unix::net::UnixStream;

    use super::*;

    #[test]
    fn a_file_arrives_with_its_bytes_and_in_order() {
        let (near, far) = UnixStream::pair().unwrap();
        let (near, far) = (Stream::Unix(near), Stream::Unix(far));
        let (mut files, mut buffer) = (VecDeque::new(), [0; 64]);
        let blocked = near.try_receive_with_files(&mut buffer, &mut files).unwrap_err();
        assert_eq!(blocked.kind(), io::ErrorKind::WouldBlock);
        near.try_send(b"plain").unwrap();
        let kept: Vec<_> = (0..3).map(|_| tempfile::tempfile().unwrap()).collect();
        for (mut file, text) in kept.iter().zip(["one", "two", "three"]) {
            file.write_all(text.as_bytes()).unwrap();
            assert_eq!(near.try_send_with_file(text.as_bytes(), file.as_fd()).unwrap(), text.len());
        }
        let mut bytes = Vec::new();
        while files.len() < 3 {
            let len = far.receive_with_files(&mut buffer, &mut files).unwrap();
            bytes.extend_from_slice(&buffer[..len]);
        }
        assert_eq!(bytes, b"plainonetwothree");
        for (file, text) in files.into_iter().zip(["one", "two", "three"]) {
            let (mut file, mut read) = (File::from(file), String::new());
            io::Seek::rewind(&mut file).unwrap();
            file.read_to_string(&mut read).unwrap();
            assert_eq!(read, text);
        }
        drop(near);
        assert_eq!(far.receive_with_files(&mut buffer, &mut VecDeque::new()).unwrap(), 0);
    }

    #[test]
    fn only_a_unix_socket_carries_files() {
        let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
        let stream = std::net::TcpStream::connect(listener.local_addr().unwrap()).unwrap();
        let file = tempfile::tempfile().unwrap();
        let error = Stream::Tcp(stream).try_send_with_file(b"x", file.as_fd()).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::Unsupported);
    }
}
