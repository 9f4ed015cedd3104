//! Attacks with scene files: the result is an error that names the cause, or a scene that renders
//! frames.

use hivtac_twin::Scene;

/// The largest number of pixels of a frame that is rendered.
const PIXELS: usize = 80 * 80;

/// Reads the input as a scene file.
pub fn attack(input: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(input) else {
        return false;
    };
    match Scene::from_toml(text) {
        Ok(scene) => {
            gives_truth(&scene);
            true
        }
        Err(error) => {
            assert!(!error.to_string().is_empty());
            false
        }
    }
}

fn gives_truth(scene: &Scene) {
    for time_s in [0.0, 0.4] {
        let force = scene.truth(time_s).force;
        let parts = [force.magnitude_n(), force.alpha_deg(), force.beta_deg()];
        assert!(parts.iter().all(|part| part.is_finite()), "{parts:?}");
    }
    let camera = scene.camera();
    if camera.width() as usize * camera.height() as usize <= PIXELS {
        scene.frame(1, 0.1);
    }
}
