//! Frames: a header, a mask, a payload.

use std::io::Read;

use super::WebsocketError;

/// Greatest length of a message in bytes. SMAC's maps, which clients send, have about 100 kB; a replay stays below 1 MB.
pub const MESSAGE_LENGTH_MAX: usize = 16 << 20;
/// Greatest length of the payload of a control frame, by the standard.
const CONTROL_LENGTH_MAX: usize = 125;

/// What a frame is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Opcode {
    /// Goes on with the message before.
    Continuation,
    /// Text in name; bytes in StarCraft's clients.
    Text,
    /// Bytes.
    Binary,
    /// The end.
    Close,
    /// Asks for a pong.
    Ping,
    /// Answers a ping.
    Pong,
}

/// One frame, unmasked.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Frame {
    /// Whether it is the last of its message.
    pub(super) is_final: bool,
    pub(super) opcode: Opcode,
    pub(super) payload: Vec<u8>,
}

impl Opcode {
    const ALL: [(Self, u8); 6] = [
        (Self::Continuation, 0),
        (Self::Text, 1),
        (Self::Binary, 2),
        (Self::Close, 8),
        (Self::Ping, 9),
        (Self::Pong, 10),
    ];

    fn from_bits(bits: u8) -> Option<Self> {
        let found = Self::ALL.into_iter().find(|(_, number)| *number == bits);
        found.map(|(opcode, _)| opcode)
    }

    fn bits(self) -> u8 {
        let found = Self::ALL.into_iter().find(|(opcode, _)| *opcode == self);
        found.map_or(0, |(_, number)| number)
    }

    pub(super) const fn is_control(self) -> bool {
        matches!(self, Self::Close | Self::Ping | Self::Pong)
    }
}

/// The bytes of a message in one frame; clients give a `mask`, servers none.
pub(super) fn encode(opcode: Opcode, payload: &[u8], mask: Option<[u8; 4]>) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(payload.len() + 14);
    bytes.push(0x80 | opcode.bits());
    let mask_bit = if mask.is_some() { 0x80 } else { 0 };
    if let Ok(length) = u8::try_from(payload.len())
        && length <= 125
    {
        bytes.push(mask_bit | length);
    } else if let Ok(length) = u16::try_from(payload.len()) {
        bytes.push(mask_bit | 126);
        bytes.extend(length.to_be_bytes());
    } else {
        bytes.push(mask_bit | 127);
        bytes.extend((payload.len() as u64).to_be_bytes());
    }
    let from = bytes.len() + mask.map_or(0, |mask| mask.len());
    bytes.extend(mask.into_iter().flatten());
    bytes.extend_from_slice(payload);
    if let Some(mask) = mask {
        unmask(&mut bytes[from..], mask);
    }
    bytes
}

/// Reads one frame. `is_masked` says whether the peer has to mask, as clients do; `room` is the greatest payload.
pub(super) fn read(
    input: &mut impl Read,
    is_masked: bool,
    room: usize,
) -> Result<Frame, WebsocketError> {
    let [first, second] = read_array(input)?;
    let opcode = Opcode::from_bits(first & 0x0F)
        .ok_or_else(|| WebsocketError::protocol(format!("unknown opcode {}", first & 0x0F)))?;
    let is_final = first & 0x80 != 0;
    if first & 0x70 != 0 {
        return Err(WebsocketError::protocol("reserved bits are set"));
    }
    if (second & 0x80 != 0) != is_masked {
        let expected = if is_masked { "masked" } else { "unmasked" };
        return Err(WebsocketError::protocol(format!(
            "expected a {expected} frame"
        )));
    }
    let length = match second & 0x7F {
        126 => u64::from(u16::from_be_bytes(read_array(input)?)),
        127 => u64::from_be_bytes(read_array(input)?),
        short => u64::from(short),
    };
    let room = if opcode.is_control() {
        CONTROL_LENGTH_MAX
    } else {
        room
    };
    let length = usize::try_from(length)
        .ok()
        .filter(|length| *length <= room)
        .ok_or_else(|| {
            WebsocketError::protocol(format!(
                "a frame of {length} bytes, expected at most {room}"
            ))
        })?;
    if opcode.is_control() && !is_final {
        return Err(WebsocketError::protocol("a control frame in parts"));
    }
    let mask: Option<[u8; 4]> = is_masked.then(|| read_array(input)).transpose()?;
    // The payload grows with what arrives, so a length alone claims no memory.
    let mut payload = Vec::new();
    let read = input.take(length as u64).read_to_end(&mut payload)?;
    if read < length {
        return Err(WebsocketError::Closed);
    }
    if let Some(mask) = mask {
        unmask(&mut payload, mask);
    }
    Ok(Frame {
        is_final,
        opcode,
        payload,
    })
}

fn unmask(payload: &mut [u8], mask: [u8; 4]) {
    for (byte, mask) in payload.iter_mut().zip(mask.into_iter().cycle()) {
        *byte ^= mask;
    }
}

fn read_array<const N: usize>(input: &mut impl Read) -> Result<[u8; N], WebsocketError> {
    let mut bytes = [0; N];
    input.read_exact(&mut bytes).map_err(|error| {
        if error.kind() == std::io::ErrorKind::UnexpectedEof {
            WebsocketError::Closed
        } else {
            error.into()
        }
    })?;
    Ok(bytes)
}
