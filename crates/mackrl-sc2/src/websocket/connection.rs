//! One open websocket.

use std::{
    hash::{BuildHasher, RandomState},
    io::{self, BufReader, Read, Write},
    net::{SocketAddr, TcpStream},
    time::{Duration, Instant},
};

use tungstenite::{
    handshake::client::generate_key,
    protocol::frame::{
        FrameSocket,
        coding::{Control, Data, OpCode},
    },
};

use super::{
    MESSAGE_LENGTH_MAX, WebsocketError,
    frame::{self, BINARY, CLOSE, PONG},
    handshake,
};

/// An open websocket on which whole messages are sent and received.
///
/// After an error the connection is of no more use: a message may have been cut in two.
#[derive(Debug)]
pub struct Connection {
    socket: FrameSocket<Timed>,
    is_client: bool,
    /// Source of masks, which only have to differ.
    masks: (RandomState, u64),
}

/// A socket whose reads and writes end by a deadline.
#[derive(Debug)]
struct Timed {
    stream: TcpStream,
    deadline: Option<(Instant, Duration)>,
}

impl Connection {
    /// Connects to the game at `address` within `patience`.
    ///
    /// # Errors
    /// If nobody listens there, or it is no game.
    pub fn connect(address: SocketAddr, patience: Duration) -> Result<Self, WebsocketError> {
        let stream = TcpStream::connect_timeout(&address, patience)?;
        let mut input = Timed::begin(stream, patience)?;
        let key = generate_key();
        let request = handshake::request(&address.to_string(), &key);
        write(input.get_mut(), request.as_bytes())?;
        let head = handshake::read_head(&mut input).map_err(name_lateness(patience))?;
        handshake::check_answer(&head, &key)?;
        Ok(Self::open(input, true))
    }

    /// Answers a client that has connected, within `patience`.
    ///
    /// # Errors
    /// If it does not ask for the game's websocket; it has been told then.
    pub fn accept(stream: TcpStream, patience: Duration) -> Result<Self, WebsocketError> {
        let mut input = Timed::begin(stream, patience)?;
        let head = handshake::read_head(&mut input).map_err(name_lateness(patience))?;
        let (response, is_granted) = handshake::answer(&head);
        write(input.get_mut(), response.as_bytes())?;
        if is_granted {
            Ok(Self::open(input, false))
        } else {
            Err(WebsocketError::protocol(format!(
                "a client asked for something else: {:?}",
                head.lines()
                    .next()
                    .unwrap_or_default()
                    .chars()
                    .take(80)
                    .collect::<String>()
            )))
        }
    }

    /// Sends one message of bytes within `patience`.
    ///
    /// # Errors
    /// If the peer is gone or does not read.
    pub fn send(
        &mut self,
        message: &[u8],
        patience: Option<Duration>,
    ) -> Result<(), WebsocketError> {
        self.wait_at_most(patience);
        self.send_frame(BINARY, message)
    }

    /// Receives one message, however it is marked; waits for ever without `patience`. Pings are answered on the way.
    ///
    /// # Errors
    /// If the peer is late, has closed the connection, or breaks the protocol.
    pub fn receive(&mut self, patience: Option<Duration>) -> Result<Vec<u8>, WebsocketError> {
        self.wait_at_most(patience);
        let late = name_lateness(patience.unwrap_or_default());
        self.receive_message().map_err(late)
    }

    /// Sends bytes as they are, whatever they mean to the peer.
    #[cfg(test)]
    pub(super) fn send_unframed(&mut self, bytes: &[u8]) -> Result<(), WebsocketError> {
        write(self.socket.get_mut(), bytes)
    }

    /// The websocket that begins behind the head that was read from `input`.
    fn open(input: BufReader<Timed>, is_client: bool) -> Self {
        let behind = input.buffer().to_vec();
        Self {
            socket: FrameSocket::from_partially_read(input.into_inner(), behind),
            is_client,
            masks: (RandomState::new(), 0),
        }
    }

    fn wait_at_most(&mut self, patience: Option<Duration>) {
        self.socket.get_mut().deadline = deadline(patience);
    }

    fn receive_message(&mut self) -> Result<Vec<u8>, WebsocketError> {
        let mut message: Option<Vec<u8>> = None;
        loop {
            let room = MESSAGE_LENGTH_MAX - message.as_ref().map_or(0, Vec::len);
            let (opcode, is_final, payload) = frame::read(&mut self.socket, !self.is_client, room)?;
            match (opcode, &mut message) {
                (OpCode::Control(Control::Close), _) => {
                    // The peer may have gone already; it is the end either way.
                    let _ = self.send_frame(CLOSE, &[]);
                    return Err(WebsocketError::Closed);
                }
                (OpCode::Control(Control::Ping), _) => {
                    self.send_frame(PONG, &payload)?;
                    continue;
                }
                (OpCode::Control(_), _) => continue,
                (OpCode::Data(Data::Continue), Some(message)) => message.extend(payload),
                (OpCode::Data(Data::Continue), None) => {
                    return Err(WebsocketError::protocol(
                        "a message that begins in its middle",
                    ));
                }
                (OpCode::Data(_), None) => message = Some(payload),
                (OpCode::Data(_), Some(_)) => {
                    return Err(WebsocketError::protocol("a message within a message"));
                }
            }
            if is_final {
                return Ok(message.unwrap_or_default());
            }
        }
    }

    fn send_frame(&mut self, opcode: OpCode, payload: &[u8]) -> Result<(), WebsocketError> {
        let mask = self.is_client.then(|| {
            let [a, b, c, d, ..] = self.random().to_le_bytes();
            [a, b, c, d]
        });
        let late = name_lateness(self.socket.get_ref().patience());
        let sent = self.socket.send(frame::whole(opcode, payload, mask));
        sent.map_err(|error| late(frame::in_words(error)))
    }

    fn random(&mut self) -> u64 {
        self.masks.1 += 1;
        self.masks.0.hash_one(self.masks.1)
    }
}

impl Timed {
    /// A socket on which a handshake has to end within `patience`.
    fn begin(stream: TcpStream, patience: Duration) -> io::Result<BufReader<Self>> {
        stream.set_nodelay(true)?;
        Ok(BufReader::new(Self {
            stream,
            deadline: deadline(Some(patience)),
        }))
    }

    fn patience(&self) -> Duration {
        self.deadline
            .map_or(Duration::ZERO, |(_, patience)| patience)
    }

    /// What is left of the time, as sockets want it.
    fn rest(&self) -> io::Result<Option<Duration>> {
        let Some((deadline, _)) = self.deadline else {
            return Ok(None);
        };
        let rest = deadline.saturating_duration_since(Instant::now());
        if rest.is_zero() {
            return Err(io::ErrorKind::TimedOut.into());
        }
        Ok(Some(rest))
    }
}

impl Read for Timed {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.stream.set_read_timeout(self.rest()?)?;
        self.stream.read(buffer)
    }
}

impl Write for Timed {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        self.stream.set_write_timeout(self.rest()?)?;
        self.stream.write(buffer)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.stream.flush()
    }
}

fn deadline(patience: Option<Duration>) -> Option<(Instant, Duration)> {
    patience.map(|patience| (Instant::now() + patience, patience))
}

fn write(timed: &mut Timed, bytes: &[u8]) -> Result<(), WebsocketError> {
    let late = name_lateness(timed.patience());
    timed.write_all(bytes).map_err(|error| late(error.into()))
}

/// Calls the operating system's word for it lateness.
fn name_lateness(patience: Duration) -> impl Fn(WebsocketError) -> WebsocketError {
    move |error| match error {
        WebsocketError::InputOutput(cause)
            if matches!(
                cause.kind(),
                io::ErrorKind::TimedOut | io::ErrorKind::WouldBlock
            ) =>
        {
            WebsocketError::Late(patience)
        }
        WebsocketError::InputOutput(cause)
            if matches!(
                cause.kind(),
                io::ErrorKind::ConnectionReset
                    | io::ErrorKind::ConnectionAborted
                    | io::ErrorKind::BrokenPipe
                    | io::ErrorKind::UnexpectedEof
            ) =>
        {
            WebsocketError::Closed
        }
        other => other,
    }
}
