mod common;
#[test]
fn dump() {
    let run = common::Setup::new(common::firmware(), 480).run();
    for t in &run.truth {
        println!(
            "truth frame {} exp {} at {}",
            t["frame"], t["exposure"], t["time_us"]
        );
    }
    for m in &run.messages {
        println!("{m:?}");
    }
    println!("{:#?}", run.report);
}
