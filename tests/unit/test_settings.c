/* Settings: one table for files, programs and the command line, and docs/scene.md and docs/flat.md say the
 * same. */
#include "testing.h"

static void takes(vsh_scene *scene, const char *name, const char *text) {
    assert_ok(vsh_scene_set(scene, name, text, &failure));
}

TEST(a_setting_goes_where_the_file_would_put_it) {
    vsh_scene scene = vsh_scene_default();
    takes(&scene, "rays", "17");
    takes(&scene, "--max-error", "5e-3");
    takes(&scene, "ao.distance", "0.5");
    takes(&scene, "ao.method", "cones");
    takes(&scene, "ao.bent_normals", "tangent");
    takes(&scene, "--ambient", "0,0.25,1");
    takes(&scene, "--tint", "1,1.2,1.5");
    takes(&scene, "unit", "cm");
    takes(&scene, "error", NULL);
    takes(&scene, "irradiance", "true");
    assert_int_equal(scene.shade.rays, 17);
    assert_true(scene.shade.max_error == 5e-3 && scene.shade.ao_distance == 0.5 && scene.unit == 0.01);
    assert_true(scene.ao && scene.error && scene.irradiance && scene.has_ambient);
    assert_int_equal(scene.shade.ao_method, VSH_AO_CONES);
    assert_int_equal(scene.bent, VSH_BENT_TANGENT);
    assert_true(scene.ambient[0] == 0.0 && scene.ambient[1] == 0.25 && scene.ambient[2] == 1.0);
    assert_true(scene.tint.type == VSH_TINT_POWER && scene.tint.power[2] == 1.5);
    takes(&scene, "irradiance", "false");
    takes(&scene, "--ao", "auto");
    assert_true(!scene.irradiance && scene.ao && scene.shade.ao_distance == 0.0);

    vsh_receiver receiver = vsh_receiver_default();
    assert_ok(vsh_receiver_set(&receiver, "--size", "64x32", &failure));
    assert_true(receiver.width == 64 && receiver.height == 32);
    assert_ok(vsh_receiver_set(&receiver, "receivers.size", "16", &failure));
    assert_true(receiver.width == 16 && receiver.height == 16);
    assert_ok(vsh_receiver_set(&receiver, "--pack", "R=ao", &failure));
    assert_string_equal(receiver.pack, "R=ao");
}

TEST(a_resolution_and_a_voxel_size_take_each_others_place) {
    vsh_scene scene = vsh_scene_default();
    assert_false(scene.voxels_named);
    takes(&scene, "voxel_size", "0.25");
    assert_true(scene.voxels_named && scene.grid.voxel_size == 0.25);
    takes(&scene, "resolution", "64");
    assert_true(scene.grid.resolution == 64 && scene.grid.voxel_size == 0.0);
}

TEST(refused_settings_change_nothing) {
    static const struct {
        const char *name, *text, *says;
        vsh_result result;
    } cases[] = {
        {"--rays", "5000", "--rays '5000': expected a whole number from 1 to 4096", VSH_ERROR_INPUT},
        {"--rays", "1.5", "--rays '1.5': expected a whole number", VSH_ERROR_INPUT},
        {"rays", " 5", "rays ' 5': expected a whole number", VSH_ERROR_INPUT},
        {"rays", "1e3", "rays '1e3': expected a whole number", VSH_ERROR_INPUT},
        {"rays", "", "rays '': expected", VSH_ERROR_INPUT},
        {"rays", NULL, "rays '': expected", VSH_ERROR_INPUT},
        {"max_error", "nan", "expected a number from 0.0001 to 1", VSH_ERROR_INPUT},
        {"jitter", "0x1", "expected a number from 0 to 1", VSH_ERROR_INPUT},
        {"jitter", "0.5,", "expected a number from 0 to 1", VSH_ERROR_INPUT},
        {"voxel_size", "0", "expected a number from 1e-12 to 1e+12", VSH_ERROR_INPUT},
        {"method", "cones", "expected one of hard, classic", VSH_ERROR_INPUT},
        {"ambient", "1,-1,1", "expected three numbers of at least 0", VSH_ERROR_INPUT},
        {"ambient", "1,1", "expected three numbers", VSH_ERROR_INPUT},
        {"tint", "0,1,1", "powers from 0.0625 to 16", VSH_ERROR_INPUT},
        {"unit", "mile", "expected m, cm, mm, in, ft, or metres", VSH_ERROR_INPUT},
        {"error", "maybe", "expected true or false", VSH_ERROR_INPUT},
        {"casters", "a.obj", "casters: no such setting of a scene", VSH_ERROR_ARGUMENT},
        {"--padding", "4", "--padding: no such setting of a scene", VSH_ERROR_ARGUMENT},
        {"", "4", "no such setting", VSH_ERROR_ARGUMENT},
    };
    for (size_t i = 0; i < COUNT_OF(cases); ++i) {
        const vsh_scene before = vsh_scene_default();
        vsh_scene scene = before;
        const vsh_result result = vsh_scene_set(&scene, cases[i].name, cases[i].text, &failure);
        assert_that(result == cases[i].result && strstr(failure.message, cases[i].says) != NULL,
                    "%s %s: %s: %s", cases[i].name, cases[i].text, vsh_result_name(result), failure.message);
        assert_memory_equal(&scene, &before, sizeof scene);
    }
}

TEST(settings_of_a_flat_scene_are_its_own) {
    vsh_flat_scene flat = vsh_flat_scene_default();
    static const char *const given[][2] = {{"--size", "64x32"},       {"supersample", "3"},
                                           {"--padding", "7"},        {"--bits", "16"},
                                           {"--color-space", "srgb"}, {"pack", "R=shadow.a"}};
    for (size_t i = 0; i < COUNT_OF(given); ++i) {
        assert_ok(vsh_flat_scene_set(&flat, given[i][0], given[i][1], &failure));
    }
    const vsh_flat_options *o = &flat.options;
    assert_true(o->width == 64 && o->height == 32 && o->supersample == 3);
    assert_true(o->padding == 7 && flat.bits == 16);
    assert_int_equal(flat.color_space, VSH_COLOR_SRGB);
    assert_string_equal(flat.pack, "R=shadow.a");

    const vsh_flat_scene before = flat;
    assert_fails(vsh_flat_scene_set(&flat, "--supersample", "17", &failure), VSH_ERROR_INPUT,
                 "expected a whole number from 1 to 16");
    assert_fails(vsh_flat_scene_set(&flat, "--rays", "4", &failure), VSH_ERROR_ARGUMENT,
                 "no such setting of a flat scene");
    assert_memory_equal(&flat, &before, sizeof flat);
    vsh_scene scene = vsh_scene_default();
    assert_int_equal(vsh_scene_set(&scene, "supersample", "3", &failure), VSH_ERROR_ARGUMENT);
}

/* --- docs/scene.md, docs/flat.md */

/* Part `column` of "| a | b | c |". */
static void cell(const char *line, int column, char *text, size_t size) {
    for (int i = 0; i <= column && line != NULL; ++i) {
        line = strchr(line, '|');
        line = line != NULL ? line + 1 : NULL;
    }
    const char *end = line != NULL ? strchr(line, '|') : NULL;
    snprintf(text, size, "%.*s", end != NULL ? (int)(end - line) : 0, end != NULL ? line : "");
}

/* The row of the key, of the section that it stands in. */
static void row_of(const vsh_setting *setting, char *row, size_t size) {
    const char *dot = strchr(setting->key, '.'), *key = dot != NULL ? dot + 1 : setting->key;
    const char *section = setting->owner == VSH_SETTING_OF_RECEIVER ? "## Receivers"
                          : dot != NULL                             ? "## Ambient occlusion"
                                                                    : "## The scene";
    FILE *file =
        fopen(setting->owner == VSH_SETTING_OF_FLAT ? VSH_DOCS "/flat.md" : VSH_DOCS "/scene.md", "r");
    assert_non_null(file);
    char begins[80];
    snprintf(begins, sizeof begins, "| `%s` |", key);
    bool here = false, found = false;
    while (!found && fgets(row, (int)size, file) != NULL) {
        if (strncmp(row, "## ", 3) == 0) {
            here = strncmp(row, section, strlen(section)) == 0;
        }
        found = here && strncmp(row, begins, strlen(begins)) == 0;
    }
    fclose(file);
    assert_that(found, "%s: no row in docs/scene.md or docs/flat.md", setting->key);
}

/* Every number of `words` stands in `text`, in that order. */
static void expect_numbers(const vsh_setting *setting, const char *words, const char *text) {
    static const char digits[] = "0123456789.";
    const char *at = text;
    for (const char *c = words + strcspn(words, digits); *c != '\0';) {
        char number[32];
        snprintf(number, sizeof number, "%.*s", (int)strspn(c, digits), c);
        at = strstr(at, number);
        assert_that(at != NULL, "%s: '%s' in the table, '%s' in the document", setting->key, words, text);
        at += strlen(number);
        c += strlen(number);
        c += strcspn(c, digits);
    }
}

TEST(the_document_has_every_key_with_its_range_and_default) {
    vsh_setting setting;
    size_t count = 0, ranges = 0, defaults = 0;
    for (; vsh_setting_get(count, &setting) != 0; ++count) {
        char row[2048], text[512];
        row_of(&setting, row, sizeof row);
        const bool names = setting.range[strcspn(setting.range, "0123456789")] == '\0';
        if (!names) {
            cell(row, 3, text, sizeof text);
            expect_numbers(&setting, setting.range, strstr(text, "see") != NULL ? row : text);
            ++ranges;
        }
        if (setting.otherwise[strspn(setting.otherwise, "0123456789.")] == '\0' &&
            setting.otherwise[0] != '\0') { /* a number alone */
            cell(row, 2, text, sizeof text);
            expect_numbers(&setting, setting.otherwise, text);
            ++defaults;
        } else if (names && strstr(setting.range, setting.otherwise) != NULL) {
            cell(row, 2, text, sizeof text);
            assert_that(strstr(text, setting.otherwise) != NULL,
                        "%s: default '%s' in the table, '%s' in docs/scene.md", setting.key,
                        setting.otherwise, text);
        }
    }
    assert_true(count >= 33 && ranges >= 19 && defaults >= 12);
}
