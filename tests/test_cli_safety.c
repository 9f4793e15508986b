/* Nothing is lost to a mistake at the command line: outputs that fail alone, outputs that are inputs, the rights and
 * links of files that are replaced. */
#define _GNU_SOURCE
#include "support/program_test.h"

#include <stdlib.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>

/* Runs a line of shell in the test's folder; $P is the program. Gives back the exit status; what was said on standard
 * error goes to `errors`. */
static int run_shell(void **state, const char *line, char *errors, size_t size)
{
    char command[2048], path[256];
    assert_int_equal(setenv("P", ((const ca_program *)*state)->path, 1), 0);
    snprintf(command, sizeof command, "cd '%s' && { %s\n} > said.out 2> said.err", folder_of(state), line);
    const int status = system(command);
    assert_true(WIFEXITED(status));
    snprintf(path, sizeof path, "%s/said.err", folder_of(state));
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    errors[fread(errors, 1, size - 1, file)] = '\0';
    fclose(file);
    return WEXITSTATUS(status);
}

static void assert_shell(void **state, int expected, const char *line)
{
    char errors[4096];
    const int status = run_shell(state, line, errors, sizeof errors);
    if (status != expected) fail_msg("exit status %d instead of %d:\n%s\n%s", status, expected, line, errors);
}

static void assert_image(void **state, const char *name, uint32_t width, uint32_t height)
{
    ca_image_layers *image = read_image(state, name);
    assert_true(image->width == width && image->height == height);
    ca_layers_destroy(image);
}

/* ---- One output fails ------------------------------------------------------------------------------------------ */

/* Files of more than 16 KiB stand for those that a full disk does not take: a .pfm of 48 KiB fails, compressed ones
 * of an even picture go on. ThreadSanitizer's runtime keeps its shadow memory in files and does not start under such
 * a limit. */
#define ON_A_FULL_DISK "ulimit -f 32; "

static void skip_without_limits(void **state)
{
    char errors[4096];
    if (run_shell(state, ON_A_FULL_DISK "$P --version", errors, sizeof errors) != 0) skip();
}

/* Nothing but light of radiance 1: all pixels are the same. */
static const char even_scene[] =
    "<scene version=\"3.0.0\"><integrator type=\"path\"><integer name=\"max_depth\" value=\"3\"/></integrator>\n"
    "  <sensor type=\"perspective\"><film type=\"hdrfilm\"><rfilter type=\"box\"/>\n"
    "    <integer name=\"width\" value=\"64\"/><integer name=\"height\" value=\"64\"/></film></sensor>\n"
    "  <emitter type=\"constant\"/></scene>\n";

static void test_others_are_written_when_one_fails(void **state)
{
    char errors[4096];
    skip_without_limits(state);
    write_text(folder_of(state), "even.xml", even_scene);
    assert_int_equal(run_shell(state,
                               ON_A_FULL_DISK "$P render even.xml -o a.pfm -o b.pfm -o c.exr -o d.png --stats e.json",
                               errors, sizeof errors),
                     1);
    assert_says(errors, "caustica: a.pfm: cannot write");
    assert_says(errors, "caustica: b.pfm: cannot write");
    assert_false(exists(folder_of(state), "a.pfm") || exists(folder_of(state), "b.pfm"));
    assert_image(state, "c.exr", 64, 64);
    assert_image(state, "d.png", 64, 64);
    json_t *stats = load_json(folder_of(state), "e.json");
    assert_true(json_number(stats, "iterations") == 4.0);
    json_decref(stats);
}

static void test_images_are_written_when_statistics_fail(void **state)
{
    char errors[4096];
    assert_shell(state, 0, "mkdir gone");
    const char *const words[] = {"render",      "ball.xml", "-o",      "a.exr", "--stats",
                                 "gone/a.json", "--time=3", "--serve", NULL};
    ca_program_result r;
    const pid_t process = ca_program_start(*state, words, -1);
    /* The address is told once all places are checked. */
    assert_int_equal(run_shell(state,
                               "for i in $(seq 600); do grep -q 'live view' .stdout && break; sleep 0.05; done; "
                               "rmdir gone",
                               errors, sizeof errors),
                     0);
    ca_program_finish(*state, process, &r);
    assert_exit(&r, 1);
    assert_says(r.errors, "caustica: gone/a.json: cannot write");
    assert_image(state, "a.exr", 24, 16);
}

/* Maps and a page that cannot be written do not keep images from being compared, nor the numbers from their file. */
static void test_numbers_are_written_when_maps_fail(void **state)
{
    char errors[4096];
    skip_without_limits(state);
    assert_shell(state, 0,
                 "for i in 1 2 3; do $P render ball.xml --quiet --resolution 128x96 --spp 1 --seed $i -o n$i.exr; "
                 "done");
    assert_int_equal(run_shell(state,
                               ON_A_FULL_DISK "$P compare n1.exr n2.exr --reference n3.exr --maps maps.exr "
                                              "--html page.html --stats s.json > said.txt",
                               errors, sizeof errors),
                     1);
    assert_says(errors, "caustica: maps-n1.exr: cannot write");
    assert_says(errors, "caustica: maps-n2.exr: cannot write");
    assert_says(errors, "caustica: page.html");
    assert_shell(state, 0, "grep -qx n2.exr said.txt");
    assert_false(exists(folder_of(state), "page.html"));
    json_t *stats = load_json(folder_of(state), "s.json");
    assert_int_equal(json_array_size(json_object_get(stats, "images")), 2);
    json_decref(stats);
}

/* Renders that cannot be kept are measured all the same, and the numbers written. */
static void test_numbers_are_written_when_renders_fail(void **state)
{
    char errors[4096];
    skip_without_limits(state);
    assert_shell(state, 0, "$P render ball.xml --quiet --resolution 128x96 --spp 4 -o r.exr");
    assert_int_equal(run_shell(state,
                               ON_A_FULL_DISK "$P converge ball.xml --resolution 128x96 -i path --spp 1,2 "
                                              "--reference r.exr -o curves",
                               errors, sizeof errors),
                     1);
    assert_says(errors, "caustica: curves/renders/path-1spp-1.exr: cannot write");
    assert_says(errors, "caustica: curves/renders/path-2spp-1.exr: cannot write");
    json_t *root = load_json(folder_of(state), "curves/converge.json");
    assert_int_equal(json_array_size(json_object_get(root, "renders")), 2);
    json_decref(root);
}

/* What cannot be read may be what hours went into: it is not rendered over, and what is complete is written. */
static void test_unreadable_renders_are_not_replaced(void **state)
{
    char errors[4096];
    assert_shell(state, 0, "$P render ball.xml --quiet --spp 4 -o r.exr && mkdir -p some/renders/path-2spp-1.exr");
    assert_int_equal(run_shell(state, "$P converge ball.xml -i path --spp 1,2 --reference r.exr -o some", errors,
                               sizeof errors),
                     1);
    assert_says(errors, "caustica: some/renders/path-2spp-1.exr: ");
    assert_true(exists(folder_of(state), "some/renders/path-2spp-1.exr"));
    json_t *root = load_json(folder_of(state), "some/converge.json");
    assert_int_equal(json_array_size(json_object_get(root, "renders")), 1);
    json_decref(root);
    write_text(folder_of(state), "balls.json",
               "{ \"title\": \"balls\", \"question\": \"Any?\", \"image\": { \"spp\": 1 },\n"
               "  \"reference\": { \"integrator\": \"path\", \"spp\": 2, \"seed\": 3 },\n"
               "  \"scenarios\": [{ \"name\": \"ball\", \"scene\": \"ball.xml\" }] }\n");
    assert_shell(state, 0, "mkdir -p seen/images/ball-reference.exr");
    assert_int_equal(run_shell(state, "$P study balls.json -o seen", errors, sizeof errors), 1);
    assert_says(errors, "scenario ball, reference: seen/images/ball-reference.exr: not a regular file");
}

/* Who asks for a picture does not want the work to end, whatever the command. */
static void test_usr1_ends_nothing(void **state)
{
    static const char *const commands[] = {
        "converge ball.xml -i path --spp 1,2,2000000 --reference r.exr -o curves",
        "noise ball.xml -i bdpm --radius 0.3 --iterations 100000",
        "study slow.json -o seen",
    };
    write_text(folder_of(state), "slow.json",
               "{ \"title\": \"balls\", \"question\": \"Any?\", \"image\": { \"spp\": 1 },\n"
               "  \"reference\": { \"integrator\": \"path\", \"spp\": 2000000, \"seed\": 3 },\n"
               "  \"scenarios\": [{ \"name\": \"ball\", \"scene\": \"ball.xml\" }] }\n");
    assert_shell(state, 0, "$P render ball.xml --quiet --spp 4 -o r.exr");
    for (size_t i = 0; i < sizeof commands / sizeof commands[0]; i++) {
        char line[512];
        /* It may be sent once it is caught: bit 9 of the mask. */
        snprintf(line, sizeof line,
                 "$P %s > usr1.out 2>&1 & p=$!; for i in $(seq 100); do "
                 "grep -q '^SigCgt.*[2367abef]..$' /proc/$p/status && break; sleep 0.05; done; "
                 "kill -USR1 $p; sleep 0.1; kill -TERM $p; wait $p; s=$?; [ $s -le 1 ]",
                 commands[i]);
        assert_shell(state, 0, line);
    }
}

static void test_image_is_written_when_strategies_fail(void **state)
{
    char errors[4096];
    skip_without_limits(state);
    assert_int_equal(run_shell(state,
                               ON_A_FULL_DISK "$P render ball.xml --resolution 96x64 -o a.png --stats a.json "
                                              "--dump-strategies full",
                               errors, sizeof errors),
                     1);
    assert_says(errors, "caustica: full/");
    assert_says(errors, "cannot write");
    assert_image(state, "a.png", 96, 64);
    assert_true(exists(folder_of(state), "a.json"));
}

/* One picture of a technique that cannot be written does not keep the others, and the page, from it. */
static void test_other_strategies_are_written(void **state)
{
    char errors[4096];
    assert_int_equal(run_shell(state,
                               "mkdir -p some/hit_s3_t0_unweighted.exr; "
                               "$P render ball.xml -o a.png --max-depth 5 --dump-strategies some",
                               errors, sizeof errors),
                     1);
    assert_says(errors, "caustica: some/hit_s3_t0_unweighted.exr: cannot write");
    static const char *const others[] = {"a.png", "some/hit_s3_t0_weight.exr", "some/hit_s3_t0_weighted.exr",
                                         "some/next_event_s2_t1_weighted.exr", "some/index.html"};
    for (size_t i = 0; i < sizeof others / sizeof others[0]; i++)
        if (!exists(folder_of(state), others[i])) fail_msg("no %s", others[i]);
}

static void test_image_is_written_when_a_part_fails(void **state)
{
    char errors[4096];
    skip_without_limits(state);
    assert_shell(state, 0, "$P render ball.xml --resolution 96x64 -i qmcppm --blocks 0:1 -o whole.part");
    assert_int_equal(run_shell(state,
                               ON_A_FULL_DISK "$P render ball.xml --resolution 96x64 -i qmcppm --blocks 0:1 "
                                              "-o a.part -o a.png -o a.pfm --stats a.json",
                               errors, sizeof errors),
                     1);
    assert_says(errors, "caustica: a.part: cannot write");
    assert_says(errors, "caustica: a.pfm: cannot write");
    assert_image(state, "a.png", 96, 64);
    assert_true(exists(folder_of(state), "a.json"));
    assert_int_equal(run_shell(state, ON_A_FULL_DISK "$P merge whole.part -o b.part -o b.pfm -o b.png --stats b.json",
                               errors, sizeof errors),
                     1);
    assert_says(errors, "caustica: b.part: cannot write");
    assert_says(errors, "caustica: b.pfm: cannot write");
    assert_shell(state, 0, "cmp a.png b.png && test -e b.json && test ! -e b.part");
}

static void test_noise_writes_the_others(void **state)
{
    char errors[4096];
    skip_without_limits(state);
    assert_int_equal(run_shell(state,
                               ON_A_FULL_DISK "$P noise ball.xml --resolution 48x32 --iterations 2 "
                                              "--light-paths 100 -o a.exr -o a.png --stats a.json",
                               errors, sizeof errors),
                     1);
    assert_says(errors, "caustica: a.exr: cannot write");
    assert_image(state, "a.png", 48, 32);
    assert_true(exists(folder_of(state), "a.json"));
}

static void test_comparison_is_written_without_its_page(void **state)
{
    char errors[4096];
    skip_without_limits(state);
    write_text(folder_of(state), "even.xml", even_scene);
    assert_shell(state, 0, "$P render even.xml -o a.exr");
    assert_int_equal(run_shell(state, ON_A_FULL_DISK "$P compare a.exr -r a.exr --html a.html --stats a.json", errors,
                               sizeof errors),
                     1);
    assert_says(errors, "caustica: a.html: cannot write");
    json_decref(load_json(folder_of(state), "a.json"));
}

/* ---- An output that is read, or written twice ------------------------------------------------------------------ */

/* Refused as wrong usage before anything is done, with these words; nothing in the folder is touched. */
static void assert_refused(void **state, const char *line, const char *words)
{
    char errors[4096];
    assert_shell(state, 0,
                 "find . -type f ! -name 'said.*' ! -name '*.sums' -exec sha256sum {} + | sort > before.sums");
    const int status = run_shell(state, line, errors, sizeof errors);
    if (status != 2) fail_msg("exit status %d instead of 2:\n%s\n%s", status, line, errors);
    assert_says(errors, words);
    assert_shell(state, 0,
                 "find . -type f ! -name 'said.*' ! -name '*.sums' -exec sha256sum {} + | sort > after.sums\n"
                 "cmp before.sums after.sums");
}

/* A scene of several files, each of another kind. */
static void write_scene_of_files(void **state)
{
    const char *folder = folder_of(state);
    assert_shell(state, 0, "mkdir parts && $P render ball.xml --spp 1 --quiet -o parts/map.png -o parts/sky.exr");
    write_text(folder, "parts/cube.ply",
               "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\n"
               "property float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\n"
               "end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
    write_text(folder, "parts/grey.spd", "400 0.5\n700 0.5\n");
    write_text(folder, "parts/more.xml",
               "<scene version=\"3.0.0\"><shape type=\"sphere\"><bsdf type=\"diffuse\">"
               "<spectrum name=\"reflectance\" filename=\"grey.spd\"/></bsdf></shape></scene>\n");
    write_text(folder, "many.xml",
               "<scene version=\"3.0.0\"><integrator type=\"path\"><integer name=\"max_depth\" "
               "value=\"3\"/></integrator><sensor type=\"perspective\"/><include filename=\"parts/more.xml\"/>\n"
               "<shape type=\"ply\"><string name=\"filename\" value=\"parts/cube.ply\"/><bsdf type=\"diffuse\">"
               "<texture type=\"bitmap\" name=\"reflectance\"><string name=\"filename\" value=\"parts/map.png\"/>"
               "</texture></bsdf></shape>\n<emitter type=\"envmap\"><string name=\"filename\" "
               "value=\"parts/sky.exr\"/></emitter></scene>\n");
}

static void test_files_of_the_scene_are_kept(void **state)
{
    write_scene_of_files(state);
    assert_refused(state, "$P render many.xml -o a.exr --stats many.xml",
                   "--stats would overwrite many.xml, which is the scene");
    static const char scene[] = "from which the scene is read (as parts/";
    assert_refused(state, "cd parts && $P render ../many.xml -o map.png",
                   "--output would overwrite map.png, from which");
    assert_refused(state, "$P render many.xml -o ./parts/sky.exr", scene);
    assert_refused(state, "$P render many.xml -o a.exr --stats ./parts/cube.ply", scene);
    assert_refused(state, "$P render many.xml -o a.exr --stats ./parts/more.xml", scene);
    assert_refused(state, "$P render many.xml -o a.exr --stats ./parts/grey.spd", scene);
    assert_refused(state, "$P noise many.xml -o ./parts/map.png", scene);
    assert_refused(state, "$P noise many.xml --stats many.xml",
                   "--stats would overwrite many.xml, which is the scene");
    /* The files that are made where none is named. */
    assert_shell(state, 0, "sed 's,parts/,,g' many.xml > parts/map.xml");
    assert_refused(state, "cd parts && $P render map.xml",
                   "--output would overwrite map.png, from which the scene is read");
}

/* The same of pbrt's and of glTF's files. */
static void write_scenes_of_other_formats(void **state)
{
    const char *folder = folder_of(state);
    write_text(folder, "parts/more.pbrt", "Shape \"plymesh\" \"string filename\" \"parts/cube.ply\"\n");
    write_text(folder, "many.pbrt",
               "Camera \"perspective\"\nFilm \"rgb\" \"integer xresolution\" 8 \"integer yresolution\" 6\n"
               "WorldBegin\n"
               "LightSource \"infinite\" \"rgb L\" [1 1 1]\n"
               "Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"parts/map.png\"\n"
               "Material \"diffuse\" \"texture reflectance\" \"t\"\nInclude \"parts/more.pbrt\"\n");
    assert_shell(state, 0, "head -c 60 /dev/zero > parts/square.bin");
    write_text(folder, "many.gltf",
               "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[0,1]}],"
               "\"nodes\":[{\"camera\":0},{\"mesh\":0}],\"cameras\":[{\"type\":\"perspective\","
               "\"perspective\":{\"yfov\":0.75,\"aspectRatio\":1.5,\"znear\":0.125}}],\"meshes\":[{\"primitives\":"
               "[{\"attributes\":{\"POSITION\":0,\"TEXCOORD_0\":1},\"material\":0}]}],\"materials\":"
               "[{\"pbrMetallicRoughness\":{\"baseColorTexture\":{\"index\":0}}}],\"textures\":[{\"source\":0}],"
               "\"images\":[{\"uri\":\"parts/map.png\"}],\"accessors\":[{\"bufferView\":0,\"componentType\":5126,"
               "\"count\":3,\"type\":\"VEC3\"},{\"bufferView\":1,\"componentType\":5126,\"count\":3,"
               "\"type\":\"VEC2\"}],\"bufferViews\":[{\"buffer\":0,\"byteLength\":36},"
               "{\"buffer\":0,\"byteOffset\":36,\"byteLength\":24}],"
               "\"buffers\":[{\"uri\":\"parts/square.bin\",\"byteLength\":60}]}\n");
}

static void test_files_of_other_formats_are_kept(void **state)
{
    static const char *const lines[] = {"many.pbrt -o ./parts/map.png", "many.pbrt -o a.exr --stats ./parts/cube.ply",
                                        "many.pbrt -o a.exr --stats ./parts/more.pbrt",
                                        "many.gltf -o ./parts/map.png",
                                        "many.gltf -o a.exr --stats ./parts/square.bin"};
    write_scene_of_files(state);
    write_scenes_of_other_formats(state);
    for (size_t i = 0; i < sizeof lines / sizeof lines[0]; i++) {
        char line[128];
        snprintf(line, sizeof line, "$P render %s", lines[i]);
        assert_refused(state, line, "from which the scene is read (as parts/");
    }
    assert_refused(state, "$P render many.gltf -o a.exr --stats many.gltf", "which is the scene");
}

static void test_links_hide_no_file(void **state)
{
    assert_shell(state, 0,
                 "ln ball.xml hard.json; ln -s ball.xml soft.json; ln -s nowhere.exr soft.exr; ln -s . here");
    assert_refused(state, "$P render ball.xml -o a.exr --stats hard.json",
                   "--stats would overwrite hard.json, which is the scene (as ball.xml)");
    assert_refused(state, "$P render ball.xml -o a.exr --stats soft.json", "which is the scene (as ball.xml)");
    assert_refused(state, "$P render ball.xml -o soft.exr --stats nowhere.exr",
                   "--output soft.exr and --stats nowhere.exr are the same file");
    assert_refused(state, "$P render ball.xml -o here/a.exr -o a.exr", "--output here/a.exr and --output a.exr are");
    assert_refused(state, "ln -sf ball.xml soft.part; $P render ball.xml -o a.exr --checkpoint soft.part --resume",
                   "--checkpoint would overwrite soft.part, which is the scene (as ball.xml)");
}

static void test_outputs_differ(void **state)
{
    assert_refused(state, "$P render ball.xml -o a.exr --stats a.exr",
                   "--output a.exr and --stats a.exr are the same");
    assert_refused(state, "$P render ball.xml -o a.exr -o ./a.exr",
                   "--output a.exr and --output ./a.exr are the same");
    assert_refused(state, "mkdir -p s; $P render ball.xml -o a.exr --stats s/index.html --dump-strategies s",
                   "--stats s/index.html and --dump-strategies s/index.html are the same file");
    assert_refused(state,
                   "mkdir -p s; $P render ball.xml --max-depth 5 -o s/hit_s0_t2_weight.exr --dump-strategies s",
                   "--output s/hit_s0_t2_weight.exr and --dump-strategies s/hit_s0_t2_weight.exr are the same file");
    assert_shell(state, 0, "cp ball.xml s/next_event_s1_t2_weighted.exr");
    assert_refused(state,
                   "$P render s/next_event_s1_t2_weighted.exr --max-depth 5 -o a.exr --dump-strategies s",
                   "--dump-strategies would overwrite s/next_event_s1_t2_weighted.exr, which is the scene");
    /* Names that are alike in folders that are not, and a file that is there already, are fine. */
    assert_shell(state, 0, "mkdir one two; for i in 1 2; do $P render ball.xml -o one/a.exr -o two/a.exr; done");
}

static void test_inputs_of_commands_are_kept(void **state)
{
    assert_shell(state, 0,
                 "$P render ball.xml -i qmcppm --blocks 0:1 -o p0.part && "
                 "$P render ball.xml -i qmcppm --blocks 1:2 -o p1.part && $P render ball.xml -o ref.exr && "
                 "echo '{}' > a.json && ln ref.exr hard.exr && mkdir out && cp ref.exr out/index.html");
    assert_refused(state, "$P merge p0.part p1.part -o ./p0.part",
                   "--output would overwrite ./p0.part, which is to be merged (as p0.part)");
    assert_shell(state, 0,
                 "$P render ball.xml --passes 0:2 -o q0.part && $P render ball.xml --passes 2:4 -o q1.part && "
                 "ln q1.part hard.part");
    assert_refused(state, "$P merge q0.part q1.part -o hard.part",
                   "--output would overwrite hard.part, which is to be merged (as q1.part)");
    assert_refused(state, "$P merge p0.part -o a.exr --stats p0.part",
                   "--stats would overwrite p0.part, which is to be");
    assert_refused(state, "$P render ball.xml -i bdpm --rays ref.exr -o ref.exr",
                   "--output would overwrite ref.exr, from which --rays reads");
    assert_refused(state, "$P render ball.xml -i bdpm --rays p0.part -o a.exr --stats ./p0.part",
                   "--stats would overwrite ./p0.part, from which --rays reads (as p0.part)");
    assert_refused(state, "$P study --analyse a.json --stats a.json", "--stats would overwrite a.json, which holds");
    assert_refused(state, "$P compare ref.exr -r ref.exr --maps hard.exr",
                   "--maps would overwrite hard.exr, which is to be compared (as ref.exr)");
    assert_refused(state, "$P compare ref.exr -r ref.exr --html a.x --stats a.x",
                   "--html a.x and --stats a.x are the same");
    assert_refused(
        state, "mkdir -p out/renders out/pictures; $P converge ball.xml -i path --spp 1:2 -r out/index.html -o out",
        "--output would overwrite out/index.html, which is the reference");
}

/* ---- Rights and links ------------------------------------------------------------------------------------------ */

static void test_rights_are_kept(void **state)
{
    assert_shell(state, 0,
                 "umask 027; $P render ball.xml -o new.exr --stats new.json --quiet; "
                 "test $(stat -c %a new.exr) = 640 && test $(stat -c %a new.json) = 640");
    assert_shell(state, 0,
                 "for m in 600 664 444 755; do rm -f a.exr; echo old > a.exr; chmod $m a.exr; umask 022; "
                 "$P render ball.xml -o a.exr --quiet || exit 3; test $(stat -c %a a.exr) = $m || exit 4; done");
    assert_image(state, "a.exr", 24, 16);
}

static void test_links_are_followed(void **state)
{
    char errors[4096];
    assert_shell(state, 0,
                 "mkdir -p here there/deep; echo old > there/a.exr; ln -s ../there/one.exr here/a.exr; "
                 "ln -s a.exr there/one.exr; ln -s there/deep/none.exr new.exr; ln -s loop.exr loop.exr");
    assert_shell(state, 0, "$P render ball.xml -o here/a.exr -o new.exr --quiet");
    assert_shell(state, 0, "test -L here/a.exr && test -L there/one.exr && test -L new.exr && test ! -L there/a.exr");
    assert_image(state, "there/a.exr", 24, 16);
    assert_image(state, "there/deep/none.exr", 24, 16);
    assert_shell(state, 0, "test -z \"$(find . -name '*.exr.*')\"");
    assert_int_equal(run_shell(state, "$P render ball.xml -o loop.exr", errors, sizeof errors), 1);
    assert_says(errors, "loop.exr: cannot write: Too many levels of symbolic links");
}

/* ---- A machine that has no more -------------------------------------------------------------------------------- */

static void test_what_a_kill_left_is_named(void **state)
{
    char errors[4096];
    write_text(folder_of(state), "even.xml", even_scene);
    assert_int_equal(run_shell(state, "touch a.exr.~abc123 b.exr.~abc123 && $P render even.xml -o a.exr", errors,
                               sizeof errors),
                     0);
    assert_says(errors, "a.exr.~abc123 was left by a program that was killed");
    assert_int_equal(run_shell(state,
                               "mkdir shown && touch shown/any.exr.~abc123 shown/.~abc123 shown/any.exr.~abc12 && "
                               "$P render even.xml -o a.exr --dump-strategies shown",
                               errors, sizeof errors),
                     0);
    assert_says(errors, "shown/any.exr.~abc123 was left by a program that was killed");
    assert_null(strstr(errors, "shown/.~abc123"));
    assert_null(strstr(errors, "abc12 "));
    assert_null(strstr(errors, "b.exr"));
}

/* Each thread takes 8 MiB of addresses for its stack. */
static void test_threads_that_cannot_be_made(void **state)
{
    char errors[4096];
    write_text(folder_of(state), "even.xml", even_scene);
    if (run_shell(state, "ulimit -s 8192; ulimit -v 3000000; $P --version", errors, sizeof errors) != 0) skip();
    assert_int_equal(run_shell(state,
                               "ulimit -s 8192; ulimit -v 3000000; $P render even.xml -i path --resolution 1024x1024 "
                               "--threads 1000 -o a.pfm",
                               errors, sizeof errors),
                     1);
    assert_says(errors, "the system gives no more threads, 1000 are wanted");
    assert_false(exists(folder_of(state), "a.pfm"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        PROGRAM_TEST(test_others_are_written_when_one_fails),
        PROGRAM_TEST(test_images_are_written_when_statistics_fail),
        PROGRAM_TEST(test_numbers_are_written_when_maps_fail),
        PROGRAM_TEST(test_numbers_are_written_when_renders_fail),
        PROGRAM_TEST(test_unreadable_renders_are_not_replaced),
        PROGRAM_TEST(test_usr1_ends_nothing),
        PROGRAM_TEST(test_image_is_written_when_strategies_fail),
        PROGRAM_TEST(test_other_strategies_are_written),
        PROGRAM_TEST(test_image_is_written_when_a_part_fails),
        PROGRAM_TEST(test_noise_writes_the_others),
        PROGRAM_TEST(test_comparison_is_written_without_its_page),
        PROGRAM_TEST(test_files_of_the_scene_are_kept),
        PROGRAM_TEST(test_files_of_other_formats_are_kept),
        PROGRAM_TEST(test_links_hide_no_file),
        PROGRAM_TEST(test_outputs_differ),
        PROGRAM_TEST(test_inputs_of_commands_are_kept),
        PROGRAM_TEST(test_rights_are_kept),
        PROGRAM_TEST(test_links_are_followed),
        PROGRAM_TEST(test_what_a_kill_left_is_named),
        PROGRAM_TEST(test_threads_that_cannot_be_made),
    };
    return run_program_tests("cli_safety", tests, sizeof tests / sizeof tests[0]);
}
