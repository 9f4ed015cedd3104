#![cfg_attr(fuzzing, no_main)]
#![allow(missing_docs)]

hivtac_fuzz::target!("model");
