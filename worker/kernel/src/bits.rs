//! Numbers of as many bits as they need, in a row of bits: the lowest bit of a byte comes first.

/// Writes bits.
#[derive(Debug, Default)]
pub(crate) struct Writer {
    bytes: Vec<u8>,
    /// Bits that fill no byte yet, and how many there are: fewer than 8 between calls.
    waiting: u64,
    bits: u32,
}

impl Writer {
    /// At most 32 bits.
    #[inline]
    fn put(&mut self, number: u64, bits: u32) {
        self.waiting |= number << self.bits;
        self.bits += bits;
        while self.bits >= 32 {
            self.bytes
                .extend_from_slice(&(self.waiting as u32).to_le_bytes());
            self.waiting >>= 32;
            self.bits -= 32;
        }
    }

    /// A number below 2^32 - 1 that is small as a rule, in Elias' gamma code of the number plus 1.
    #[inline]
    pub(crate) fn put_gamma(&mut self, number: u32) {
        let (low, bits) = split(number);
        self.put(1 << bits, bits + 1);
        self.put(low, bits);
    }

    /// A number below 2^32 - 1 of any size: how many bits the number plus 1 has after its first one, in 5
    /// bits, then these.
    #[inline]
    pub(crate) fn put_classed(&mut self, number: u32) {
        let (low, bits) = split(number);
        self.put(u64::from(bits), 5);
        self.put(low, bits);
    }

    /// All bytes; what is left of the last one is 0.
    pub(crate) fn finish(mut self) -> Vec<u8> {
        let left = self.bits.div_ceil(8) as usize;
        self.bytes
            .extend_from_slice(&self.waiting.to_le_bytes()[..left]);
        self.bytes
    }
}

/// What follows the first bit of a number plus 1, and how many bits that are.
#[inline]
fn split(number: u32) -> (u64, u32) {
    let more = u64::from(number) + 1;
    let bits = more.ilog2();
    (more - (1 << bits), bits)
}

/// Reads what a [`Writer`] wrote. Past the end it reads zeros, and says so.
pub(crate) struct Reader<'a> {
    bytes: &'a [u8],
    /// Bytes that were read into `waiting`; past the end, as if there were more.
    at: usize,
    waiting: u64,
    /// Bits of `waiting` that are not taken.
    bits: u32,
}

impl<'a> Reader<'a> {
    pub(crate) fn new(bytes: &'a [u8]) -> Self {
        Self {
            bytes,
            at: 0,
            waiting: 0,
            bits: 0,
        }
    }

    /// Sees to it that at least 56 bits wait.
    #[inline]
    fn fill(&mut self) {
        if let Some(next) = self.bytes.get(self.at..)
            && let Some(next) = next.first_chunk::<8>()
        {
            self.waiting |= u64::from_le_bytes(*next) << self.bits;
            let whole = (63 - self.bits) / 8;
            self.at += whole as usize;
            self.bits += 8 * whole;
        } else {
            while self.bits < 56 {
                let byte = self.bytes.get(self.at).copied().unwrap_or(0);
                self.waiting |= u64::from(byte) << self.bits;
                self.at += 1;
                self.bits += 8;
            }
        }
    }

    /// Takes bits of those that wait.
    #[inline]
    fn take(&mut self, bits: u32) -> u64 {
        let number = self.waiting & ((1 << bits) - 1);
        self.waiting >>= bits;
        self.bits -= bits;
        number
    }

    /// See [`Writer::put_gamma`]; nothing where there is no such number.
    #[inline]
    pub(crate) fn take_gamma(&mut self) -> Option<u32> {
        self.fill();
        let bits = self.waiting.trailing_zeros();
        if bits > 31 {
            return None;
        }
        self.take(bits + 1);
        if bits > 20 {
            self.fill();
        }
        Some(join(self.take(bits), bits))
    }

    /// See [`Writer::put_classed`].
    #[inline]
    pub(crate) fn take_classed(&mut self) -> u32 {
        if self.bits < 36 {
            self.fill();
        }
        let bits = self.take(5) as u32;
        join(self.take(bits), bits)
    }

    /// Goes on to the next whole byte.
    pub(crate) fn align(&mut self) {
        self.take(self.bits % 8);
    }

    /// Bytes that were taken, whole or in part.
    pub(crate) fn taken_bytes(&self) -> usize {
        self.at - self.bits as usize / 8
    }

    /// Whether bits were taken that there are not.
    #[inline]
    pub(crate) fn is_beyond_end(&self) -> bool {
        self.at > self.bytes.len() && self.taken_bytes() > self.bytes.len()
    }

    /// Whether all bytes are read, though not all of them taken.
    pub(crate) fn nears_end(&self) -> bool {
        self.at > self.bytes.len()
    }

    pub(crate) fn is_at_end(&self) -> bool {
        self.taken_bytes() == self.bytes.len()
    }
}

/// Undoes [`split`]; the largest number stands for one that is too large.
#[inline]
fn join(low: u64, bits: u32) -> u32 {
    ((1u64 << bits) + low - 1) as u32
}
