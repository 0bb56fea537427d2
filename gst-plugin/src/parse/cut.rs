//! Where a packet starts and ends in bytes that may be damaged or cut off. In: bytes. Out: what to do with them.

use tetvec::bitstream::{Limits, PacketHeader, find_packet, parse_packet_header};

/// Bytes to ask for where not even a packet's header is there: more than any header has, and not worth a request less.
const HEADER_BYTES: usize = 64;

/// What to do with the bytes at hand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Cut {
    /// A whole packet stands at the front.
    Packet(PacketHeader),
    /// As many bytes are no packet; > 0.
    Skip(usize),
    /// As many bytes are needed to tell, more than are there.
    Need(usize),
}

/// Looks at `bytes`, which are not empty; `complete` says that no more will come.
pub(super) fn cut(bytes: &[u8], complete: bool, limits: &Limits) -> Cut {
    let need = match parse_packet_header(bytes, limits) {
        Ok(Some(header)) if header.length <= bytes.len() => return Cut::Packet(header),
        Ok(Some(header)) => header.length,
        Ok(None) => HEADER_BYTES.max(bytes.len() + 1),
        Err(_) => return Cut::Skip(skip(bytes, limits)),
    };
    // Cut off by the end of the stream, or a start code by chance: what is behind may still be a packet.
    if complete { Cut::Skip(skip(bytes, limits)) } else { Cut::Need(need) }
}

/// Bytes to the next place where a packet may start, at least one.
fn skip(bytes: &[u8], limits: &Limits) -> usize {
    bytes.get(1..).map_or(1, |rest| 1 + find_packet(rest, limits))
}

#[cfg(test)]
mod tests {
    use super::{Cut, cut};
    use tetvec::bitstream::{IndexWriter, Limits};

    /// A small whole packet: the index of a stream without frames.
    fn packet() -> Vec<u8> {
        IndexWriter::new().finish().expect("an index").data
    }

    #[test]
    fn a_whole_packet_is_cut_off_what_follows() {
        let one = packet();
        let two = [one.clone(), one.clone()].concat();
        for complete in [false, true] {
            match cut(&two, complete, &Limits::default()) {
                Cut::Packet(header) => assert_eq!(header.length, one.len()),
                other => panic!("{other:?}"),
            }
        }
    }

    #[test]
    fn a_packet_cut_off_anywhere_waits_for_more_or_is_skipped() {
        let whole = packet();
        for length in 1..whole.len() {
            match cut(&whole[..length], false, &Limits::default()) {
                Cut::Need(bytes) => assert!(bytes > length),
                other => panic!("{length}: {other:?}"),
            }
            match cut(&whole[..length], true, &Limits::default()) {
                Cut::Skip(bytes) => assert!((1..=length).contains(&bytes)),
                other => panic!("{length}: {other:?}"),
            }
        }
    }

    #[test]
    fn garbage_is_skipped_up_to_the_packet_behind() {
        let garbage = b"no packet \x89TET \x89TVP here";
        let bytes = [garbage.as_slice(), &packet()].concat();
        let mut at = 0;
        while let Cut::Skip(skipped) = cut(&bytes[at..], true, &Limits::default()) {
            at += skipped;
        }
        assert_eq!(at, garbage.len());
    }
}
