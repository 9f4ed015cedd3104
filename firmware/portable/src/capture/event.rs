//! Defines the events that the tracker sends to the follower.

/// The VSYNC edge that begins a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Edge {
    /// 1 for the first edge that counts, and so on modulo 2³²; 0 before the first edge.
    pub number: u32,
    /// Device time, µs since boot.
    pub time_us: u64,
}

/// A finished band.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Band {
    /// Number of bands finished before it since boot, modulo 2³². It determines the slot
    /// ([`Shape::slot`](crate::capture::Shape::slot)).
    pub sequence: u32,
    /// Number of bands of the same frame above it.
    pub index: u16,
    /// The edge that began its frame.
    pub edge: Edge,
}

/// How a frame ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Ending {
    /// The frame has exactly its number of bytes.
    Whole,
    /// The frame has fewer bytes.
    Short,
    /// The frame has more bytes.
    Long,
    /// The DMA was too slow for the camera interface.
    Overrun,
    /// An interrupt came too late: it is unknown which rows belong to the frame.
    Late,
}

/// An event for the follower. Events come in the order in which they happened.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Event {
    /// A band is in its slot.
    Band(Band),
    /// A frame has ended. If it is not whole, no band of it follows.
    Ended {
        /// The edge that began it.
        edge: Edge,
        /// How.
        how: Ending,
    },
    /// The camera was set up, completely or with other settings. Its frames after number `from`, up
    /// to `to`, are counted elsewhere.
    Passed {
        /// The newest frame before the set-up; 0 if there was none.
        from: u32,
        /// The newest frame during the set-up.
        to: u32,
        /// True if the camera was restarted because it was silent or did not answer.
        restart: bool,
    },
}
