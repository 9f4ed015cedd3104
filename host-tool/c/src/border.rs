//! The border to C: failures become error codes with a text, and no panic crosses it.

use hivtac_host::failure::{Failure, Kind};
use std::cell::RefCell;
use std::ffi::{CStr, CString, c_char, c_int};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Duration;

/// `HIVTAC_ERROR_INTERNAL` of the header.
const INTERNAL: c_int = -100;

thread_local! {
    static LAST: RefCell<CString> = RefCell::default();
}

/// The text of this thread's last failure; valid until the next one.
pub fn last() -> *const c_char {
    LAST.with(|last| last.try_borrow().map_or(c"".as_ptr(), |text| text.as_ptr()))
}

fn set_last(text: &str) {
    let text = CString::new(text.replace('\0', " ")).unwrap_or_default();
    LAST.with(|last| last.replace(text));
}

/// The number of a failure in the header: its exit code, negative.
fn number(failure: &Failure) -> c_int {
    -c_int::from(failure.kind.exit_code())
}

/// Does the work; a failure or a panic leaves its text, and its number is the error.
pub fn guarded<T>(work: impl FnOnce() -> Result<T, Failure>) -> Result<T, c_int> {
    match catch_unwind(AssertUnwindSafe(work)) {
        Ok(Ok(done)) => Ok(done),
        Ok(Err(failure)) => {
            set_last(&failure.to_string());
            Err(number(&failure))
        }
        Err(panic) => {
            let text = panic.downcast_ref::<&str>().copied();
            let text = text.or_else(|| panic.downcast_ref::<String>().map(String::as_str));
            let text = text.unwrap_or("unknown");
            set_last(&format!(
                "a mistake of this library, please report it: {text}"
            ));
            Err(INTERNAL)
        }
    }
}

/// A time of C.
pub fn seconds(time_s: f64) -> Result<Duration, Failure> {
    Duration::try_from_secs_f64(time_s)
        .map_err(|_| Failure::input(format!("timeout_s: {time_s} s is no time to wait")))
}

/// A text of C, which has to be UTF-8.
pub fn utf8<'a>(text: &'a CStr, name: &str) -> Result<&'a str, Failure> {
    let why = |_| Failure::new(Kind::Input, format!("{name}: not UTF-8"));
    text.to_str().map_err(why)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failure_and_a_panic_become_a_number_and_a_text() {
        assert_eq!(guarded(|| Ok(3)), Ok(3));
        let lost = guarded(|| Err::<(), _>(Failure::new(Kind::Lost, "gone\0away")));
        assert_eq!((lost, said()), (Err(-5), "gone away".to_owned()));
        let panicked = guarded(|| -> Result<(), Failure> { panic!("broken {}", 7) });
        assert_eq!(panicked, Err(INTERNAL));
        assert!(said().contains("broken 7"), "{}", said());
    }

    fn said() -> String {
        LAST.with(|last| last.borrow().to_str().unwrap().to_owned())
    }
}
