//! A scene as the options name it, read and ready to be rendered.

use pathspace::{
    io::{self, Loaded, NamedCamera},
    scene::{Scene, camera::Sensor},
};

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
}

impl Opened {
    /// Reads the file, and says what is wrong with it.
    pub fn read(args: &SceneArgs, terminal: Terminal) -> Result<Self, Failure> {
        let mut loaded = io::load_with(&args.file, &args.load.options(args.scene.as_deref()))?;
        terminal.detail(info::describe(&loaded));
        for warning in &loaded.warnings {
            terminal.warn(warning);
        }
        loaded.geometry.set_effort(args.build.unwrap_or_default());
        let view = camera::choose(args, &loaded, terminal)?;
        let shown = loaded.summary.scene.filter(|_| loaded.summary.scenes.len() > 1);
        Ok(Self { loaded, view, shown })
    }

    /// The scene with its environment, and what an image's header says of that.
    pub fn into_scene(
        self,
        args: &SceneArgs,
        sensor: Sensor,
        terminal: Terminal,
    ) -> Result<(Scene, Option<String>), Failure> {
        let environment = environment::choose(&args.environment, &args.load.limits(), &self.loaded, terminal)?;
        let scene = self.loaded.into_scene(self.view.to_camera(sensor), environment.light);
        Ok((if args.cull_backfaces { scene.culling_back_faces() } else { scene }, environment.recorded))
    }
}
