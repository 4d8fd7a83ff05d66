//! Both ends on one machine, and peers that break the rules.

use std::{
    io::{Read, Write},
    net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream},
    thread,
};

use proptest::prelude::*;

use tungstenite::protocol::frame::{
    FrameSocket,
    coding::{Control, Data, OpCode},
};

use super::{
    frame::{BINARY, whole},
    *,
};

const PATIENCE: Duration = Duration::from_secs(5);

/// A frame as it goes over the wire.
fn encode(opcode: OpCode, payload: &[u8], mask: Option<[u8; 4]>) -> Vec<u8> {
    let mut bytes = Vec::new();
    let frame = whole(opcode, payload, mask);
    frame.format(&mut bytes).unwrap();
    bytes
}

/// What is read from bytes that came over the wire.
fn read(
    bytes: &[u8],
    is_masked: bool,
    room: usize,
) -> Result<(OpCode, bool, Vec<u8>), WebsocketError> {
    frame::read(&mut FrameSocket::new(bytes), is_masked, room)
}

/// A server that plays its part in a thread, and its address.
fn serve<T: Send + 'static>(
    part: impl FnOnce(TcpStream) -> T + Send + 'static,
) -> (SocketAddr, thread::JoinHandle<T>) {
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
    let address = listener.local_addr().unwrap();
    (
        address,
        thread::spawn(move || part(listener.accept().unwrap().0)),
    )
}

fn echo(stream: TcpStream) -> Result<Vec<u8>, WebsocketError> {
    let mut connection = Connection::accept(stream, PATIENCE)?;
    let message = connection.receive(Some(PATIENCE))?;
    connection.send(&message, Some(PATIENCE))?;
    Ok(message)
}

#[test]
fn messages_of_every_length_class_come_back() {
    for length in [0, 1, 125, 126, 65_535, 65_536, 1_000_003] {
        let (address, server) = serve(echo);
        let mut client = Connection::connect(address, PATIENCE).unwrap();
        let message: Vec<u8> = (0..length).map(|i: usize| i.to_le_bytes()[0]).collect();
        client.send(&message, Some(PATIENCE)).unwrap();
        assert_eq!(client.receive(Some(PATIENCE)).unwrap(), message);
        assert_eq!(server.join().unwrap().unwrap(), message);
    }
}

#[test]
fn bytes_in_frames_marked_as_text_are_taken_as_bytes() {
    let (address, server) = serve(echo);
    let mut client = Connection::connect(address, PATIENCE).unwrap();
    client
        .send_unframed(&encode(
            OpCode::Data(Data::Text),
            &[0xFF, 0xFE, 0x00],
            Some([1, 2, 3, 4]),
        ))
        .unwrap();
    assert_eq!(server.join().unwrap().unwrap(), [0xFF, 0xFE, 0x00]);
}

#[test]
fn a_message_in_parts_is_put_together_and_pings_in_between_are_answered() {
    let (address, server) = serve(echo);
    let mut client = Connection::connect(address, PATIENCE).unwrap();
    let mask = Some([9, 8, 7, 6]);
    let mut first = encode(BINARY, b"ab", mask);
    first[0] &= 0x7F;
    client.send_unframed(&first).unwrap();
    client
        .send_unframed(&encode(OpCode::Control(Control::Ping), b"?", mask))
        .unwrap();
    client
        .send_unframed(&encode(OpCode::Data(Data::Continue), b"c", mask))
        .unwrap();
    assert_eq!(server.join().unwrap().unwrap(), b"abc");
    assert_eq!(client.receive(Some(PATIENCE)).unwrap(), b"abc");
}

#[test]
fn a_silent_peer_is_late_and_a_gone_one_closed() {
    let (address, server) = serve(|stream| {
        let connection = Connection::accept(stream, PATIENCE).unwrap();
        thread::sleep(Duration::from_millis(150));
        drop(connection);
    });
    let mut client = Connection::connect(address, PATIENCE).unwrap();
    let late = client.receive(Some(Duration::from_millis(30))).unwrap_err();
    assert!(matches!(late, WebsocketError::Late(_)), "{late}");
    server.join().unwrap();
    let closed = client.receive(Some(PATIENCE)).unwrap_err();
    assert!(matches!(closed, WebsocketError::Closed), "{closed}");
}

#[test]
fn a_request_for_another_path_is_told_so() {
    let (address, server) = serve(|stream| Connection::accept(stream, PATIENCE).map(drop));
    let mut stream = TcpStream::connect(address).unwrap();
    stream.write_all(b"GET / HTTP/1.1\r\n\r\n").unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    assert!(answer.starts_with("HTTP/1.1 404"), "{answer}");
    server.join().unwrap().unwrap_err();
}

#[test]
fn a_length_alone_claims_no_memory() {
    let frame = [0x82, 0x7F, 0, 0, 0, 0, 0xFF, 0xFF, 0xFF, 0xFF];
    let error = read(&frame, false, MESSAGE_LENGTH_MAX).unwrap_err();
    assert!(matches!(error, WebsocketError::Protocol(_)), "{error}");
    let short = [0x82, 0x7F, 0, 0, 0, 0, 0, 0xFF, 0, 0];
    let error = read(&short, false, MESSAGE_LENGTH_MAX).unwrap_err();
    assert!(matches!(error, WebsocketError::Closed), "{error}");
}

#[test]
fn what_the_standard_forbids_is_refused() {
    let mask = Some([1, 2, 3, 4]);
    let refused = |frame: &[u8], is_masked: bool| {
        let error = read(frame, is_masked, 200).unwrap_err();
        assert!(matches!(error, WebsocketError::Protocol(_)), "{error}");
        error.to_string()
    };
    assert!(refused(&encode(BINARY, b"a", mask), false).contains("expected a unmasked frame"));
    assert!(refused(&encode(BINARY, b"a", None), true).contains("expected a masked frame"));
    assert!(refused(&encode(BINARY, &[0; 201], mask), true).contains("201"));
    let ping = OpCode::Control(Control::Ping);
    assert!(
        refused(&encode(ping, &[0; 126], mask), true).contains("126 bytes, expected at most 125")
    );
    assert!(refused(&[0x09, 0x00], false).contains("a control frame in parts"));
    assert!(refused(&[0xC2, 0x00], false).contains("reserved bits"));
    refused(&[0x83, 0x00], false);
}

proptest! {
    #[test]
    fn a_frame_survives_the_wire(payload: Vec<u8>, mask: Option<[u8; 4]>) {
        let bytes = encode(BINARY, &payload, mask);
        let frame = read(&bytes, mask.is_some(), MESSAGE_LENGTH_MAX).unwrap();
        prop_assert_eq!(frame, (BINARY, true, payload));
    }

    #[test]
    fn no_bytes_make_the_reader_panic(bytes: Vec<u8>, is_masked: bool) {
        let _ = read(&bytes, is_masked, 1000);
    }
}
