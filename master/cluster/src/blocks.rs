//! Blocks as they are sent.

use std::sync::Arc;

use bytes::Bytes;
use nestrad_engine::exchange::{BlockOf, ExchangeError, Sampling, demand};
use nestrad_engine::frame::Frame;
use nestrad_kernel::Demand;
use nestrad_kernel::expected::OfBlock;
use nestrad_proto::near_field::block_message;
use prost::Message;

use crate::scheduler::BlockId;

/// A block as it is sent.
pub(crate) struct SentBlock {
    pub(crate) id: BlockId,
    /// The encoded message.
    pub(crate) bytes: Bytes,
    /// What its rows must be like.
    pub(crate) known: Arc<OfBlock>,
    pub(crate) demand: Demand,
}

impl SentBlock {
    pub(crate) fn new(
        frame: &Frame,
        block: &BlockOf,
        sampling: &Sampling,
    ) -> Result<Self, ExchangeError> {
        let bytes = encoded(frame, block)?;
        let demand = demand(frame, block, sampling);
        Ok(Self {
            id: *blake3::hash(&bytes).as_bytes(),
            bytes: bytes.into(),
            known: Arc::new(OfBlock::new(frame.block(), &block.owned())),
            demand,
        })
    }
}

/// The message of a block, encoded.
pub(crate) fn encoded(frame: &Frame, block: &BlockOf) -> Result<Vec<u8>, ExchangeError> {
    let message = block_message(&block.frame(frame), block.corners(frame));
    let message = message.map_err(|fault| ExchangeError::Failed(fault.to_string()))?;
    Ok(message.encode_to_vec())
}
