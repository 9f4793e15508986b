/* Camera "realistic": where its film and its lens stand, and how bright its pictures are.
 *
 * pbrt's camera stands at the film's middle, and its lens in front of it; the distance in focus is measured from the
 * film, and the film of the lens file's last thickness is moved to it (pbrt 4, RealisticCamera::FocusThickLens). Ours
 * stands at the lens's first vertex and is told the film's distance. Lengths of the lens are in mm, those of pbrt's
 * camera space in metres. */
#include "import/pbrt/reader.h"

#include "import/lens_table.h"

void ca_pbrt_read_lens_camera(ca_pbrt *p)
{
    static const char *const without_effect[] = {"scale"};
    const char *file = ca_pbrt_string(&p->params, "lensfile", NULL);
    p->camera = CA_PBRT_REALISTIC;
    p->lens_file = file;
    p->has_aperture = ca_pbrt_find(&p->params, "aperturediameter") != NULL;
    p->aperture_diameter = ca_pbrt_number_in(&p->params, "aperturediameter", 1.0, 1e-6, 1e6);
    p->focal_distance = ca_pbrt_number_in(&p->params, "focusdistance", 10.0, 1e-6, 1e9);
    p->simple_weighting = ca_pbrt_boolean(&p->params, "simpleweighting", true);
    const double open = ca_pbrt_number(&p->params, "shutteropen", 0.0);
    p->shutter_time = fmax(0.0, ca_pbrt_number(&p->params, "shutterclose", 1.0) - open);
    ca_pbrt_ignore(&p->params, without_effect, CA_COUNT(without_effect));
    if (p->version == 3 && !p->simple_weighting && p->shutter_time == 0.0)
        ca_pbrt_fail(&p->params, "shutterclose", "must be later than shutteropen");
    if (!file) ca_pbrt_fail(&p->params, "lensfile", "is missing");
    if (ca_pbrt_find(&p->params, "aperture"))
        ca_pbrt_fail(&p->params, "aperture", "is not supported: stops are round");
}

/* Closes the lens's stop as far as the camera says; false where it stays as it is. */
static bool close_stop(ca_pbrt *p, ca_lens_table *table)
{
    const double radius = 0.5 * p->aperture_diameter;
    if (table->stop_count > 1)
        ca_import_fail(p->importer, &p->camera_where, "aperturediameter needs a lens with one stop, and this has %u",
                       table->stop_count);
    if (table->stop_count == 0 && p->has_aperture)
        ca_import_note(p->importer, &p->camera_where,
                       "aperturediameter has no effect on a realistic camera's lens that has no stop");
    if (table->stop_count != 1) return false;
    ca_lens_surface *stop = &table->lens.surfaces[table->stop];
    if (radius > stop->aperture) {
        ca_import_note(p->importer, &p->camera_where,
                       "the aperture of a realistic camera is no wider than the stop of its lens");
        return false;
    }
    stop->aperture = radius;
    return true;
}

/* Where the film is, in mm behind the lens, so that what is `from_film` in front of the film is sharp on it: of the
 * two places the one where the image is the smaller one, to which the steps lead. */
static double place_film(ca_pbrt *p, const ca_lens *lens, double from_film)
{
    enum { STEPS = 10000 };
    double film = 0.0, before = -1.0;
    for (int i = 0; i < STEPS && fabs(film - before) > 1e-15 * film; i++) {
        const double distance = from_film - ca_lens_length(lens) - film;
        before = film;
        film = distance > 0.0 ? ca_lens_image_of(lens, distance).distance : -1.0;
        if (!(film > 0.0 && film < 1e5)) break;
    }
    if (film > 0.0 && fabs(film - before) < 1e-9 * film) return film;
    ca_import_fail(p->importer, &p->camera_where,
                   "the lens makes no image on the film of what is focusdistance in front of the film; its focal "
                   "length is %.6g mm",
                   ca_lens_focal_length(lens));
    return 1.0;
}

/* pbrt's pictures are as bright as what the exit pupil's solid angle lets on the film; but of version 3 with
 * simpleweighting they do not depend on it, as ours. */
static void set_exposure(ca_pbrt *p, const ca_realistic *camera)
{
    if (p->version == 3 && p->simple_weighting) {
        ca_import_note(p->importer, &p->camera_where,
                       "through a realistic camera with simpleweighting, light of radiance 1 from everywhere is 1 in "
                       "the picture's middle");
        return;
    }
    p->exposure *= ca_realistic_solid_angle(camera);
    if (p->version == 3) p->exposure *= p->shutter_time;
}

void ca_pbrt_put_lens_camera(ca_pbrt *p)
{
    ca_matrix map;
    const double scale = ca_pbrt_split_camera_map(p, &map), mm = 1e-3 * scale;
    const char *path = ca_document_resolve(&p->importer->document, p->camera_where.file, p->lens_file);
    ca_lens_table table;
    if (!path) ca_import_fail_memory(p->importer, "a file name");
    if (!path || !ca_import_lens_file(p->importer, path, &p->camera_where, &table)) return;
    const bool closed = close_stop(p, &table);
    const double film = place_film(p, &table.lens, 1e3 * p->focal_distance);
    const ca_realistic camera = {.lens = table.lens, .film_distance = film};
    if (!ca_import_good(p->importer)) return;
    set_exposure(p, &camera);
    const ca_matrix forward = ca_matrix_translate(0.0, 0.0, mm * (ca_lens_length(&table.lens) + film));
    map = ca_matrix_multiply(&map, &forward);
    p->sensor = ca_tree_object(&p->tree, ca_tree_root(&p->tree), "sensor", "realistic");
    ca_tree_transform(&p->tree, p->sensor, "to_world", &map);
    ca_tree_string(&p->tree, p->sensor, "filename", p->lens_file);
    if (closed) ca_tree_float(&p->tree, p->sensor, "aperture_diameter", p->aperture_diameter);
    ca_tree_float(&p->tree, p->sensor, "film_distance", film);
    ca_tree_float(&p->tree, p->sensor, "lens_scale", mm);
    ca_tree_float(&p->tree, p->sensor, "film_diagonal", p->film_diagonal);
    /* Nothing of the scene is seen before the first surface's rim. */
    const double rim = -mm * ca_lens_sag(&table.lens.surfaces[0]);
    ca_tree_float(&p->tree, p->sensor, "near_clip", fmax(1e-4, rim * 1.000001));
    ca_tree_float(&p->tree, p->sensor, "far_clip", 1e10);
}
