//! Which integrator renders: the one that was asked for, or the one that a pilot chooses.

use std::{fs, io, path::Path};

use pathspace::{
    choice::{Candidate, Estimate, Say, choose},
    film::{Crop, write_atomically},
    integrator::Integrator,
    layers::PathClasses,
    path::{JoinedPath, LightPaths, NoLightPaths},
    render::Settings,
    scene::Scene,
};
use serde_json::{Value, json};

use crate::cli::shared::{exit::Failure, image::ImageArgs, terminal::Terminal};

/// The settings to render with, and where they come from.
pub struct Chosen {
    pub settings: Settings,
    /// Why this integrator, if nobody asked for it.
    pub reason: Option<String>,
    /// What the pilot has predicted, if there was one.
    pub estimates: Vec<Estimate>,
}

/// What a choice is made for.
pub struct Task<'a> {
    pub image: &'a ImageArgs,
    /// What [`ImageArgs::candidates`] says.
    pub candidates: Vec<Candidate>,
    pub crop: Crop,
    pub hash: &'a str,
    /// What the image itself takes, in bytes.
    pub of_image: u64,
    /// What [`ImageArgs::kept`] says.
    pub kept: Option<&'a (String, PathClasses)>,
}

impl Task<'_> {
    /// Asks the pilot, or the file that has its answer, where there are several candidates.
    /// `say` hears how far the pilot is, and may end it.
    pub fn choose(&self, scene: &mut Scene, terminal: Terminal, say: &mut Say<'_>) -> Result<Chosen, Failure> {
        let settings = |candidate: Candidate| self.image.settings(candidate, self.crop);
        if let [only] = self.candidates[..] {
            return Ok(Chosen { settings: settings(only)?, reason: None, estimates: Vec::new() });
        }
        let file = self.image.choice.as_deref();
        if let Some((chosen, reason)) = file.map(|file| self.read(file)).transpose()?.flatten() {
            let name = file.unwrap_or(Path::new("")).display();
            terminal.say(format_args!("auto: {chosen}, as '{name}' has it"));
            return Ok(Chosen { settings: settings(chosen)?, reason: Some(reason), estimates: Vec::new() });
        }
        let mut candidates =
            self.candidates.iter().map(|candidate| settings(*candidate)).collect::<Result<Vec<_>, _>>()?;
        candidates.retain(|candidate| self.has_room(scene, candidate));
        if candidates.is_empty() {
            return Ok(Chosen { settings: settings(self.candidates[0])?, reason: None, estimates: Vec::new() });
        }
        let (chosen, reason, estimates) = match &candidates[..] {
            [only] => (Candidate::of(only), "no other fits into memory".to_owned(), Vec::new()),
            _ => self.ask_pilot(scene, &candidates, say).ok_or_else(Failure::interrupted)?,
        };
        if let Some(file) = file {
            self.write(file, chosen, &reason, &estimates)?;
        }
        terminal.say(format_args!("auto: {chosen}, since {reason}"));
        Ok(Chosen { settings: settings(chosen)?, reason: Some(reason), estimates })
    }

    fn ask_pilot(
        &self,
        scene: &mut Scene,
        candidates: &[Settings],
        say: &mut Say<'_>,
    ) -> Option<(Candidate, String, Vec<Estimate>)> {
        let holds = |scene: &Scene, path: &JoinedPath| self.kept.is_none_or(|(_, kept)| kept.holds(scene, path));
        let choice = choose(scene, candidates, self.kept.map(|_| &holds as _), say)?;
        Some((choice.candidate(), choice.reason(), choice.estimates))
    }

    /// Whether the light vertices that it keeps fit into memory.
    fn has_room(&self, scene: &Scene, settings: &Settings) -> bool {
        let Settings { integrator: kind, max_depth, roulette, light_paths, .. } = *settings;
        let integrator = Integrator::new(kind, scene.camera.sensor(), max_depth, roulette);
        let integrator = integrator.with_light_paths(light_paths);
        self.image.check_light_vertices((kind, &integrator), scene, self.of_image).is_ok()
    }

    /// What a file says, if it is there.
    fn read(&self, file: &Path) -> Result<Option<(Candidate, String)>, Failure> {
        let name = file.display();
        let text = match fs::read_to_string(file) {
            Ok(text) => text,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(Failure::input(format!("cannot read '{name}': {error}"))),
        };
        let no_choice = |why: &str| Failure::input(format!("'{name}' holds no choice: {why}"));
        let choice: Value = serde_json::from_str(&text).map_err(|error| no_choice(&error.to_string()))?;
        if choice["scene"].as_str().is_some_and(|scene| scene != self.hash) {
            return Err(Failure::input(format!(
                "the choice in '{name}' is for another scene: take another file, or choose by -i"
            )));
        }
        let kind = choice["integrator"].as_str().ok_or_else(|| no_choice("it names no 'integrator'"))?;
        let paths: LightPaths = match &choice["light_paths"] {
            Value::Null => self.image.light_paths.unwrap_or(LightPaths::ONE),
            Value::String(text) => text.parse().map_err(|error: NoLightPaths| no_choice(&error.to_string()))?,
            other => other.to_string().parse().map_err(|error: NoLightPaths| no_choice(&error.to_string()))?,
        };
        let among = kind.parse().ok().map(|kind| Candidate::new(kind, paths)).filter(|x| self.candidates.contains(x));
        let among = among.ok_or_else(|| {
            let known: Vec<_> = self.candidates.iter().map(Candidate::to_string).collect();
            no_choice(&format!("'{kind}' with {paths} light paths is none of {}", known.join(", ")))
        })?;
        Ok(Some((among, choice["reason"].as_str().unwrap_or("by a file").to_owned())))
    }

    fn write(&self, file: &Path, chosen: Candidate, reason: &str, estimates: &[Estimate]) -> Result<(), Failure> {
        let saved = json!({
            "scene": self.hash,
            "integrator": chosen.integrator.name(),
            "light_paths": chosen.light_paths.to_string(),
            "reason": reason,
            "estimates": described(estimates),
        });
        let text = format!("{saved:#}\n");
        write_atomically(file, text.as_bytes()).map_err(|error| Failure::output(error.to_string()))
    }
}

/// What a pilot has predicted, in JSON.
pub fn described(estimates: &[Estimate]) -> Vec<Value> {
    let of_one = |estimate: &Estimate| {
        let (Candidate { integrator, light_paths }, work) = (estimate.candidate, estimate.work);
        json!({
            "integrator": integrator.name(),
            "light_paths": light_paths.to_string(),
            "error": estimate.error,
            "missed": estimate.missed,
            "camera_rays": work.camera,
            "light_rays": work.light,
            "visibility_rays": work.visibility,
            "lookups": work.lookups,
            "merges": work.merges,
            "kept_paths": work.kept_paths,
            "cost": work.cost(),
        })
    };
    estimates.iter().map(of_one).collect()
}
