//! A scene as the options name it, read and ready to be rendered.

use std::collections::BTreeSet;

use pathspace::{
    io::{self, Loaded, NamedCamera, Summary},
    scene::{Scene, camera::Sensor},
};
use rayon::ThreadPool;

use crate::cli::{
    info,
    shared::{args::SceneArgs, camera, environment, exit::Failure, terminal::Terminal},
};

/// What was read, and the camera that was chosen.
pub struct Opened {
    pub loaded: Loaded,
    pub view: NamedCamera,
    /// Which scene of a file with several.
    pub shown: Option<usize>,
    /// When its animations are shown, and which if there are several.
    pub at: Option<String>,
}

/// Reads the file, and says what is wrong with it.
pub fn load(args: &SceneArgs, terminal: Terminal) -> Result<Loaded, Failure> {
    load_after(args, &mut BTreeSet::new(), terminal)
}

/// The same, but what was `said` before is not said again.
pub fn load_after(args: &SceneArgs, said: &mut BTreeSet<String>, terminal: Terminal) -> Result<Loaded, Failure> {
    let loaded = io::load_with(&args.file, &args.load.options(args.scene.as_deref()))?;
    terminal.detail(info::describe(&loaded));
    for warning in loaded.warnings.iter().filter(|warning| said.insert((*warning).clone())) {
        terminal.warn(warning);
    }
    Ok(loaded)
}

impl Opened {
    /// Reads the file, and chooses the camera.
    pub fn read(args: &SceneArgs, terminal: Terminal) -> Result<Self, Failure> {
        Self::new(load(args, terminal)?, args, terminal)
    }

    /// What was read, seen as the options say.
    pub fn new(mut loaded: Loaded, args: &SceneArgs, terminal: Terminal) -> Result<Self, Failure> {
        loaded.geometry.set_effort(args.build.unwrap_or_default());
        let view = camera::choose(args, &loaded, terminal)?;
        let shown = loaded.summary.scene.filter(|_| loaded.summary.scenes.len() > 1);
        let at = posed(&loaded.summary);
        Ok(Self { loaded, view, shown, at })
    }

    /// The scene with its environment, and what an image's header says of that. The trees are built on the pool.
    pub fn into_scene(
        self,
        args: &SceneArgs,
        sensor: Sensor,
        pool: &ThreadPool,
        terminal: Terminal,
    ) -> Result<(Scene, Option<String>), Failure> {
        let environment = environment::choose(&args.environment, &args.load.limits(), &self.loaded, terminal)?;
        let camera = self.view.to_camera(sensor);
        let scene = pool.install(|| self.loaded.into_scene(camera, environment.light));
        Ok((if args.cull_backfaces { scene.culling_back_faces() } else { scene }, environment.recorded))
    }
}

/// `0.5 s`, `0.5 s of animation 0, 2`.
fn posed(summary: &Summary) -> Option<String> {
    let at = summary.at?;
    let shown = summary.animations.iter().enumerate().filter(|(_, animation)| animation.shown);
    let shown: Vec<_> = shown.map(|(index, _)| index.to_string()).collect();
    let which =
        if summary.animations.len() > 1 { format!(" of animation {}", shown.join(", ")) } else { String::new() };
    Some(format!("{at} s{which}"))
}
