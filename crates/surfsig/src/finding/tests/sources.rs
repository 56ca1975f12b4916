//! Models that are loaded when they are needed.

use super::*;
use std::sync::Mutex;

/// Models that remember which were loaded as a whole.
struct Counted<'a> {
    models: InMemory<'a>,
    loaded: Mutex<Vec<usize>>,
}

impl ModelSource for Counted<'_> {
    fn count(&self) -> usize {
        self.models.count()
    }

    fn radius(&self, number: usize) -> f64 {
        self.models.radius(number)
    }

    fn brief(&self, number: usize) -> Result<Cow<'_, Model>, Error> {
        self.models.brief(number)
    }

    fn whole(&self, number: usize) -> Result<Cow<'_, Model>, Error> {
        self.loaded.lock().unwrap().push(number);
        self.models.whole(number)
    }
}

fn prepared(points: &[[f64; 3]]) -> Model {
    Model::new(&Scan::new(PointCloud::new_f64(points)), None, &Monitor::default()).unwrap()
}

/// A box's surface, of which nothing in the scene has any but a face.
fn other() -> Model {
    let mut points = Vec::new();
    for (i, k) in (0..2500).map(|n| (n % 50, n / 50)) {
        let at = |n: i32| f64::from(n) / 25.0 - 0.98;
        for side in [-1.0, 1.0] {
            points.extend([[at(i), at(k), side], [at(i), side, at(k)], [side, at(i), at(k)]]);
        }
    }
    prepared(&points)
}

#[test]
fn only_models_that_may_be_there_are_loaded_and_the_same_is_found() {
    let viewpoint = [0.5, -3.0, 14.0];
    let (points, _) = scene(viewpoint);
    let there = prepared(&body(5000).into_iter().map(|(point, _)| point).collect::<Vec<_>>());
    let other = other();
    let models = [&other, &there, &other];
    let scan = Scan::new(PointCloud::new_f64(&points)).seen_from(viewpoint);
    let settings = FindSettings::default();
    let find = |models: &[&Model], settings: &FindSettings| {
        let monitor = Monitor::default();
        let source = Counted { models: InMemory(models), loaded: Mutex::default() };
        let found = find_instances_of(&source, &scan, settings, &monitor).unwrap();
        assert_eq!(monitor.done(), 2 + FIND_STEPS_PER_MODEL * models.len());
        (found, source.loaded.into_inner().unwrap())
    };
    let (found, loaded) = find(&models, &settings);
    assert_eq!(loaded, [1]);
    let (mut alone, of_one) = find(&[&there], &settings);
    assert_eq!((alone.len(), of_one), (2, vec![0]));
    alone.iter_mut().for_each(|instance| instance.model = 1);
    assert_eq!(found, alone);
    // Of more than may be searched the better one is.
    let least = FindSettings { brief_deficit: f64::INFINITY, ..settings.clone() };
    assert_eq!(find(&models, &least).1, [0, 1, 2]);
    assert_eq!(find(&models, &FindSettings { searched: 1, ..least }).1, [1]);
    // Which are open of these, and may be either side out, it cannot tell.
    let [open, closed] = [false, true].map(|is_sided| Model { is_sided, ..other.clone() });
    assert_eq!(find(&[&open, &closed, &open], &FindSettings { searched: 0, ..settings.clone() }).1, [0, 2]);
    // Where it is not known what was seen through, each is searched.
    let unknown = Scan::new(PointCloud::new_f64(&points)).seen_from([0.0, 0.0, -2.6]);
    let source = Counted { models: InMemory(&models[..2]), loaded: Mutex::default() };
    find_instances_of(&source, &unknown, &settings, &Monitor::default()).unwrap();
    assert_eq!(source.loaded.into_inner().unwrap(), [0, 1]);
}

#[test]
fn what_is_brief_of_a_model_is_a_model_and_brief_itself() {
    let model = prepared(&body(3000).into_iter().map(|(point, _)| point).collect::<Vec<_>>());
    let brief = model.brief();
    brief.check().unwrap();
    assert_eq!((brief.voxel(), brief.extent()), (model.voxel(), model.extent()));
    assert_eq!(brief.all_places().map(|places| places.len()).filter(|&count| count > 0).count(), 1);
    assert_eq!(brief.larger_places.last(), model.larger_places.last());
    assert_eq!(brief.brief(), brief);
    // Of one radius there is none larger.
    let of_one = Model { larger_places: Vec::new(), ..model.clone() };
    assert_eq!(of_one.brief().places, model.places);
}

#[test]
fn what_a_source_says_is_told() {
    struct Broken;
    impl ModelSource for Broken {
        fn count(&self) -> usize {
            2
        }
        fn radius(&self, _: usize) -> f64 {
            1.0
        }
        fn brief(&self, _: usize) -> Result<Cow<'_, Model>, Error> {
            Err(Error::InvalidModel("gone".into()))
        }
        fn whole(&self, number: usize) -> Result<Cow<'_, Model>, Error> {
            self.brief(number)
        }
    }
    let viewpoint = [0.5, -3.0, 14.0];
    let points = scene(viewpoint).0;
    let scan = Scan::new(PointCloud::new_f64(&points)).seen_from(viewpoint);
    let told = find_instances_of(&Broken, &scan, &FindSettings::default(), &Monitor::default());
    assert_eq!(told.unwrap_err(), Error::InvalidModel("gone".into()));
}

#[test]
fn the_smallest_patches_are_looked_for_where_nothing_else_tells() {
    let mut model = prepared(&body(3000).into_iter().map(|(point, _)| point).collect::<Vec<_>>());
    let radii = |model: &Model, is_free_space_known: bool| -> Vec<f64> {
        model.places_sought(is_free_space_known).iter().map(|places| places.radius).collect()
    };
    let radius = model.places.radius;
    assert_eq!(radii(&model, false), [radius]);
    let ratios: Vec<f64> = radii(&model, true).iter().map(|other| other / radius).collect();
    assert!((ratios[0] - 2.0_f64.sqrt()).abs() < 1e-9 && (ratios[1] - 2.0).abs() < 1e-9, "{ratios:?}");
    // Of a small bend in a plane large patches are flat.
    model.larger_places.iter_mut().for_each(|places| *places = FieldPlaces::new(places.radius));
    assert_eq!(radii(&model, true), [radius]);
}
