/* Meshes: each object, and what `bake` would say of their UVs in one lightmap. */
#include "cli/try.h"
#include "info.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { PARAGRAPHS = 8 }; /* more meshes have a line each */
enum { TAKEN = 64, LEAST_WIDE = 10 };

/* A file's meshes. */
typedef struct mesh_info {
    const vsh_model *model;
    size_t count;
    vsh_mesh *meshes;              /* [count] */
    vsh_solidity_report *solidity; /* [count] */
    vsh_mesh *with_uvs;            /* [with_uv_count] */
    size_t with_uv_count;
    bool table; /* a line for each */
} mesh_info;

static const char *name_of(const vsh_mesh *mesh) {
    return mesh->name != NULL ? mesh->name : "";
}

static const char *object_of(const vsh_mesh *mesh) {
    return mesh->object_name != NULL ? mesh->object_name : name_of(mesh);
}

static void print_summary(const vsh_model *model) {
    const size_t count = vsh_model_mesh_count(model);
    size_t objects = 0, triangles = 0, without = 0;
    uint32_t last = 0;
    int32_t least = VSH_MAX_UV_SETS, most = 0;
    for (size_t i = 0; i < count; ++i) {
        const vsh_mesh mesh = vsh_model_mesh(model, i, -1);
        const int32_t sets = vsh_model_uv_sets(model, i);
        objects += mesh.object == 0 || mesh.object != last;
        last = mesh.object;
        triangles += mesh.triangle_count;
        without += sets == 0;
        least = sets < least ? sets : least;
        most = sets > most ? sets : most;
    }
    printf("objects: %zu, in %zu mesh%s, %zu triangles; UV sets: %d", objects, count, count == 1 ? "" : "es",
           triangles, least);
    if (most > least) {
        printf(" to %d", most);
    }
    if (without > 0 && without < count) {
        printf(", %zu meshes without", without);
    }
    putchar('\n');
}

/* --- solids, rooms, walls and sheets */

enum { KINDS = 4 };

static const struct {
    const char *one, *many, *more_of_one, *more_of_many;
} kinds[KINDS] = {
    {"solid", "solids", "", ""},
    {"room", "rooms", " in a solid", " in solids"},
    {"wall", "walls", " with air in front of its faces", " with air in front of their faces"},
    {"sheet", "sheets", " with air on both sides", " with air on both sides"},
};

static void count_kinds(const vsh_solidity_report *report, size_t counts[KINDS]) {
    counts[0] = report->solids;
    counts[1] = report->rooms;
    counts[2] = report->walls;
    counts[3] = report->sheets;
}

/* Writes a few words, such as "solid", "3 walls" or "mixed". */
static void describe_kind(const vsh_solidity_report *report, char *text, size_t capacity) {
    size_t counts[KINDS], found = 0;
    count_kinds(report, counts);
    snprintf(text, capacity, "nothing");
    for (size_t i = 0; i < KINDS; ++i) {
        if (counts[i] == 1) {
            snprintf(text, capacity, "%s", kinds[i].one);
        } else if (counts[i] > 1) {
            snprintf(text, capacity, "%zu %s", counts[i], kinds[i].many);
        }
        found += counts[i] > 0;
    }
    if (found > 1) {
        snprintf(text, capacity, "mixed");
    }
}

static void print_problem(size_t count, const char *what) {
    if (count > 0) {
        printf("  problem: %zu %s\n", count, what);
    }
}

static void print_solidity(const vsh_solidity_report *report) {
    size_t counts[KINDS], found = 0;
    count_kinds(report, counts);
    printf("  taken for: ");
    for (size_t i = 0; i < KINDS; ++i) {
        if (counts[i] > 0) {
            printf("%s%zu %s%s", found++ > 0 ? ", " : "", counts[i],
                   counts[i] == 1 ? kinds[i].one : kinds[i].many,
                   counts[i] == 1 ? kinds[i].more_of_one : kinds[i].more_of_many);
        }
    }
    puts(found == 0 ? "nothing" : "");
    if (report->closed_over > 0) {
        printf("  closed over: %zu hole%s with %zu open edges, of %zu of these\n", report->holes,
               report->holes == 1 ? "" : "s", report->open_edges, report->closed_over);
    }
    print_problem(report->turned_triangles, "triangles that face the other way than those around");
}

/* --- a paragraph for each mesh */

/* The factor on positions if the user gives their unit. */
static double scale_for(const vsh_model *model, double unit) {
    const double own = vsh_model_unit(model);
    return unit > 0.0 ? unit / (own > 0.0 ? own : 1.0) : 1.0;
}

static void print_unit(const vsh_model *model, double unit) {
    const double own = vsh_model_unit(model);
    if (unit > 0.0) {
        printf("unit: %g m (as asked)\n", unit);
    } else if (own > 0.0) {
        printf("unit: %g m; bounds are in metres\n", own);
    } else {
        printf("unit: none in this format; bounds are the file's own numbers\n");
    }
}

/* Prints the lights that 'bake --lights' would read with its defaults. */
static int print_lights(const vsh_model *model, double unit) {
    static const double angle = 0.53 * 0.017453292519943295; /* radians */
    vsh_light *lights = NULL;
    size_t count = 0;
    vsh_error error;
    CLI_TRY(
        cli_check_result(vsh_lights_from_model(model, angle, 0.0, unit, &lights, &count, &error), &error));
    for (size_t i = 0; i < count; ++i) {
        info_print_light(&lights[i]);
    }
    vsh_lights_free(lights);
    return CLI_OK;
}

static int print_paragraph(const mesh_info *info, size_t index, const info_look *look) {
    vsh_mesh mesh = info->meshes[index];
    const double scale = scale_for(info->model, look->unit);
    double scaled[12];
    for (int i = 0; i < 12; ++i) {
        scaled[i] = mesh.transform[i] * scale;
    }
    mesh.transform = scaled;
    vsh_mesh_report report;
    vsh_uvs_measures uvs;
    vsh_error error;
    CLI_TRY(cli_check_result(vsh_mesh_check(&mesh, &report, &error), &error));
    CLI_TRY(cli_check_result(vsh_uvs_measure(&mesh, look->width, look->height, &uvs, &error), &error));
    printf("mesh %zu '%s'\n", index, name_of(&mesh));
    printf("  triangles: %zu\n  vertices: %zu\n", mesh.triangle_count, mesh.vertex_count);
    printf("  UV sets: %d\n", vsh_model_uv_sets(info->model, index));
    if (uvs.texels_per_unit > 0.0) {
        printf("  lightmap UVs: %.4g texels a unit at %d × %d, stretch %.3f\n", uvs.texels_per_unit,
               look->width, look->height, uvs.stretch);
    }
    printf("  normals: %s\n", mesh.normals != NULL ? "yes" : "no, flat");
    printf("  bounds: %g %g %g to %g %g %g\n  area: %g\n", report.bounds_min[0], report.bounds_min[1],
           report.bounds_min[2], report.bounds_max[0], report.bounds_max[1], report.bounds_max[2],
           report.area);
    if (mesh.alpha != VSH_ALPHA_OPAQUE) {
        printf("  material: %s\n",
               mesh.alpha == VSH_ALPHA_BLENDED
                   ? "blended (glass, smoke): it casts no shadow, unless its texture cuts "
                     "it out, or --cast-blended"
                   : "masked (leaves, fences): it casts by its texture's alpha");
    }
    print_problem(report.open_edges, "open edges");
    print_problem(report.flipped_edges, "edges whose triangles disagree about the outside");
    print_problem(report.degenerate_triangles, "triangles of zero area, which are skipped");
    print_solidity(&info->solidity[index]);
    return CLI_OK;
}

/* --- a line for each mesh */

static void print_row(const mesh_info *info, size_t index, const vsh_uv_report *uv, int wide) {
    char others[32] = "", itself[32] = "", taken[TAKEN];
    if (uv != NULL && uv->other_texels > 0) {
        snprintf(others, sizeof others, "%zu", uv->other_texels);
    }
    if (uv != NULL && uv->overlap_texels > uv->other_texels) {
        snprintf(itself, sizeof itself, "%zu", uv->overlap_texels - uv->other_texels);
    }
    describe_kind(&info->solidity[index], taken, sizeof taken);
    printf("%10zu %8d %12s %12s %-*s %s\n", info->meshes[index].triangle_count,
           vsh_model_uv_sets(info->model, index), others, itself, wide, taken, name_of(&info->meshes[index]));
}

/* `reports` are of the meshes with UVs; NULL: there are none. */
static void print_table(const mesh_info *info, const vsh_uv_report *reports) {
    int wide = LEAST_WIDE;
    for (size_t i = 0; i < info->count; ++i) {
        char taken[TAKEN];
        describe_kind(&info->solidity[i], taken, sizeof taken);
        wide = (int)strlen(taken) > wide ? (int)strlen(taken) : wide;
    }
    printf("%10s %8s %12s %12s %-*s %s\n", "triangles", "UV sets", "over others", "over itself", wide,
           "taken for", "mesh");
    for (size_t i = 0, next = 0; i < info->count; ++i) {
        const bool uvs = info->meshes[i].uvs != NULL && reports != NULL;
        print_row(info, i, uvs ? &reports[next++] : NULL, wide);
    }
    puts("(over others, over itself: texels that another object's triangle has, or one of its own)");
}

/* --- UVs in one lightmap */

static void print_uv_problems(const vsh_mesh *meshes, const vsh_uv_report *reports, size_t count) {
    for (size_t i = 0; i < count; ++i) {
        const vsh_uv_report *uv = &reports[i];
        const char *name = name_of(&meshes[i]);
        if (uv->overlap_texels > 0) {
            printf("  problem: mesh '%s': %zu texels of %zu triangles lie over other charts", name,
                   uv->overlap_texels, uv->overlap_triangles);
            if (uv->other_texels > 0) {
                printf(", %zu of them of other objects", uv->other_texels);
            }
            putchar('\n');
        }
        if (uv->outside_triangles > 0) {
            printf("  problem: mesh '%s': %zu triangles leave the UV square\n", name, uv->outside_triangles);
        }
        if (uv->degenerate_triangles > 0) {
            printf("  problem: mesh '%s': %zu triangles have no area in the UV set\n", name,
                   uv->degenerate_triangles);
        }
    }
}

static void print_verdict(const vsh_mesh *meshes, const vsh_uv_report *reports, size_t count,
                          uint64_t covered) {
    uint64_t texels = 0;
    size_t over = 0;
    const vsh_uv_report *worst = reports;
    for (size_t i = 0; i < count; ++i) {
        texels += reports[i].other_texels;
        over += reports[i].other_texels > 0;
        worst = reports[i].other_texels > worst->other_texels ? &reports[i] : worst;
    }
    if (texels == 0) {
        return;
    }
    const bool refused = (double)texels > VSH_LARGEST_OVERLAP * (double)covered;
    printf("%s: objects share texels: %zu of %zu meshes lie over others, on %" PRIu64
           " texels, most of all '%s', on %zu over '%s'%s\n",
           refused ? "problem" : "note", over, count, texels, object_of(&meshes[worst - reports]),
           worst->other_mesh_texels, object_of(&meshes[worst->other_mesh]),
           refused
               ? ": one image of all is refused; bake with --per-object, choose with --receive, or unwrap "
                 "them into one atlas"
               : "");
}

/* All meshes with UVs share one lightmap, as they do in `bake`. */
static int print_uvs(const mesh_info *info, const info_look *look, const vsh_run *run) {
    if (info->with_uv_count == 0) {
        if (info->table) {
            print_table(info, NULL);
        }
        return CLI_OK;
    }
    vsh_lightmap_options options = vsh_lightmap_options_default();
    options.width = look->width;
    options.height = look->height;
    vsh_uv_report *reports = calloc(info->with_uv_count, sizeof *reports);
    if (reports == NULL) {
        return cli_out_of_memory("UV reports");
    }
    vsh_run quiet = *run;
    quiet.warning = NULL; /* printed below */
    vsh_charts *charts = NULL;
    vsh_charts_info found;
    vsh_error error;
    int code;
    CLI_TRY_DONE(cli_check_result(
        vsh_charts_create(info->with_uvs, info->with_uv_count, &options, &quiet, reports, &charts, &error),
        &error));
    vsh_charts_get_info(charts, &found);
    if (info->table) {
        print_table(info, reports);
    }
    printf("lightmap of %d × %d texels: %.1f %% covered\n", look->width, look->height,
           100.0 * (double)found.covered / ((double)look->width * look->height));
    if (!info->table) {
        print_uv_problems(info->with_uvs, reports, info->with_uv_count);
    }
    print_verdict(info->with_uvs, reports, info->with_uv_count, found.covered);
done:
    vsh_charts_free(charts);
    free(reports);
    return code;
}

/* Prints the work of `bake --unwrap auto`. */
static int print_unwrap(const vsh_mesh *meshes, size_t count, const info_look *look, const vsh_run *run) {
    vsh_receiver receiver = vsh_receiver_default();
    receiver.width = look->width;
    receiver.height = look->height;
    receiver.unwrap = VSH_RECEIVER_UNWRAP_AUTO;
    int32_t needs;
    vsh_error error;
    CLI_TRY(
        cli_check_result(vsh_receiver_needs_unwrap(&receiver, meshes, count, run, &needs, &error), &error));
    if (needs == 0) {
        puts("--unwrap auto: bakes these UVs as they are");
        return CLI_OK;
    }
    size_t kept = 0;
    for (size_t i = 0; i < count; ++i) {
        int32_t usable = 0;
        if (meshes[i].uvs != NULL && vsh_uvs_usable(&meshes[i], run, &usable, &error) != VSH_OK) {
            return cli_fail_of(NULL, &error);
        }
        kept += usable != 0;
    }
    printf("--unwrap auto: packs the charts of %zu mesh%s anew, and makes those of %zu\n", kept,
           kept == 1 ? "" : "es", count - kept);
    return CLI_OK;
}

int info_print_mesh(const char *path, const info_look *look, const vsh_run *run) {
    vsh_model *model = NULL;
    vsh_error error;
    CLI_TRY(cli_check_result(vsh_model_read(path, run, &model, &error), &error));
    const size_t count = vsh_model_mesh_count(model);
    mesh_info info = {.model = model,
                      .count = count,
                      .meshes = calloc(count, sizeof *info.meshes),
                      .solidity = calloc(count, sizeof *info.solidity),
                      .with_uvs = calloc(count, sizeof *info.with_uvs),
                      .table = count > PARAGRAPHS && !look->all};
    int code;
    print_summary(model);
    if (info.meshes == NULL || info.solidity == NULL || info.with_uvs == NULL) {
        code = cli_out_of_memory(path);
        goto done;
    }
    print_unit(model, look->unit);
    for (size_t i = 0; i < count; ++i) {
        info.meshes[i] = vsh_model_mesh(model, i, -1);
        if (info.meshes[i].uvs != NULL) {
            info.with_uvs[info.with_uv_count++] = info.meshes[i];
        }
    }
    CLI_TRY_DONE(cli_check_result(vsh_mesh_solidity(info.meshes, count, run, info.solidity, &error), &error));
    for (size_t i = 0; i < count && !info.table; ++i) {
        CLI_TRY_DONE(print_paragraph(&info, i, look));
    }
    CLI_TRY_DONE(print_lights(model, look->unit));
    CLI_TRY_DONE(print_uvs(&info, look, run));
    CLI_TRY_DONE(print_unwrap(info.meshes, count, look, run));
    if (info.with_uv_count < count) {
        printf("problem: %zu of %zu meshes have no UVs to bake into: they only cast with --per-object or "
               "--no-receive; or are unwrapped\n",
               count - info.with_uv_count, count);
    }
done:
    free(info.with_uvs);
    free(info.solidity);
    free(info.meshes);
    vsh_model_free(model);
    return code;
}
