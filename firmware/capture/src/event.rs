//! What the tracker tells the follower.

/// One VSYNC edge: the one that begins a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Edge {
    /// 1 for the first edge that counts, and so on modulo 2³²; 0 when there was none yet.
    pub number: u32,
    /// Device time, µs since boot.
    pub time_us: u64,
}

/// A finished band.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Band {
    /// Bands finished before it since boot, modulo 2³². Names its slot
    /// ([`Shape::slot`](crate::Shape::slot)).
    pub sequence: u32,
    /// Bands of the same frame above it.
    pub index: u16,
    /// The edge that began its frame.
    pub edge: Edge,
}

/// How a frame ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Ending {
    /// With exactly its number of bytes.
    Whole,
    /// With fewer.
    Short,
    /// With more.
    Long,
    /// The DMA was too slow for the camera interface.
    Overrun,
    /// An interrupt came too late: which rows belong to the frame is not known.
    Late,
}

/// Something the follower has to know. Events come in the order in which things happened.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Event {
    /// A band lies in its slot.
    Band(Band),
    /// A frame has ended. For one that is not whole, no band comes after this.
    Ended {
        /// The edge that began it.
        edge: Edge,
        /// How.
        how: Ending,
    },
    /// The camera was set up, wholly or otherwise than before. Its frames after number `from` up to
    /// `to` are accounted for elsewhere.
    Passed {
        /// The newest frame before; 0 when there was none.
        from: u32,
        /// The newest frame of that time.
        to: u32,
        /// It was started again, as it had been silent or did not answer.
        restart: bool,
    },
}
