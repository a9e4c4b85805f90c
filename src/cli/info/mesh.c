#include "cli/message.h"
#include "cli/try.h"
#include "info.h"

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <vdbshade/vdbshade.h>

static const char *name_of(const vsh_mesh *mesh) {
    return mesh->name != NULL ? mesh->name : "";
}

static void print_count(size_t count, const char *what) {
    if (count > 0) {
        printf("  problem: %zu %s\n", count, what);
    }
}

/* Counts one kind of components: "2 sheets". */
static void print_kind(size_t count, const char *one, const char *many, bool *first) {
    if (count > 0) {
        printf("%s%zu %s", *first ? "" : ", ", count, count == 1 ? one : many);
        *first = false;
    }
}

static void print_solidity(const vsh_solidity_report *report) {
    bool first = true;
    printf("  taken for: ");
    print_kind(report->solids, "solid", "solids", &first);
    print_kind(report->rooms, "room in a solid", "rooms in solids", &first);
    print_kind(report->walls, "wall with air in front of its faces", "walls with air in front of their faces",
               &first);
    print_kind(report->open_solids, "open solid, hidden where only its inner sides are seen",
               "open solids, hidden where only their inner sides are seen", &first);
    print_kind(report->sheets, "sheet with air on both sides", "sheets with air on both sides", &first);
    puts(first ? "nothing" : "");
    if (report->closed_over > 0) {
        printf("  closed over: %zu hole%s with %zu open edges, of %zu of these\n", report->holes,
               report->holes == 1 ? "" : "s", report->open_edges, report->closed_over);
    }
    print_count(report->turned_triangles, "triangles that face the other way than those around");
}

/* What positions are multiplied by, where the user says what unit they are in. */
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

/* As 'bake --lights' takes them where nothing else is said. */
static int print_lights(const vsh_model *model, double unit) {
    static const double angle = 0.53 * 0.017453292519943295; /* radians */
    vsh_light *lights = NULL;
    size_t count = 0;
    vsh_error error;
    CLI_TRY(
        cli_check_result(vsh_lights_from_model(model, angle, 0.0, unit, &lights, &count, &error), &error));
    for (size_t i = 0; i < count; ++i) {
        char text[512];
        vsh_light_text(&lights[i], text, sizeof text);
        printf("light '%s': %s\n", lights[i].name, text);
    }
    vsh_lights_free(lights);
    return CLI_OK;
}

static int print_uvs(const vsh_mesh *mesh, const cli_info_look *look) {
    vsh_uvs_measures measures;
    vsh_error error;
    CLI_TRY(cli_check_result(vsh_uvs_measure(mesh, look->width, look->height, &measures, &error), &error));
    if (measures.texels_per_unit > 0.0) {
        printf("  lightmap UVs: %.4g texels a unit at %d × %d, stretch %.3f\n", measures.texels_per_unit,
               look->width, look->height, measures.stretch);
    }
    return CLI_OK;
}

static int print_mesh(const vsh_model *model, size_t index, const cli_info_look *look, double scale,
                      const vsh_solidity_report *solidity) {
    vsh_mesh mesh = vsh_model_mesh(model, index, -1);
    double scaled[12];
    for (int i = 0; i < 12; ++i) {
        scaled[i] = mesh.transform[i] * scale;
    }
    mesh.transform = scaled;
    vsh_mesh_report report;
    vsh_error error;
    CLI_TRY(cli_check_result(vsh_mesh_check(&mesh, &report, &error), &error));
    printf("mesh %zu '%s'\n", index, name_of(&mesh));
    printf("  triangles: %zu\n  vertices: %zu\n", mesh.triangle_count, mesh.vertex_count);
    printf("  UV sets: %d\n", vsh_model_uv_sets(model, index));
    CLI_TRY(print_uvs(&mesh, look));
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
    print_count(report.open_edges, "open edges");
    print_count(report.flipped_edges, "edges whose triangles disagree about the outside");
    print_count(report.degenerate_triangles, "triangles of zero area, which are skipped");
    print_solidity(solidity);
    return CLI_OK;
}

/* What `bake --unwrap auto` would do. */
static int print_unwrap(const vsh_mesh *meshes, size_t count, const cli_info_look *look, const vsh_run *run) {
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

int cli_info_mesh(const char *path, const cli_info_look *given, const vsh_run *run) {
    vsh_model *model = NULL;
    vsh_error error;
    CLI_TRY(cli_check_result(vsh_model_read(path, run, &model, &error), &error));
    const size_t count = vsh_model_mesh_count(model);
    vsh_mesh *with_uvs = calloc(count, sizeof *with_uvs);
    size_t with_uv_count = 0;
    vsh_mesh *meshes = calloc(count, sizeof *meshes);
    vsh_solidity_report *solidity = calloc(count, sizeof *solidity);
    cli_info_look look = *given;
    look.table = count > CLI_INFO_PARAGRAPHS && !look.all;
    look.solidity = solidity;
    int code = CLI_OK;
    cli_info_summary(model);
    if (with_uvs == NULL || meshes == NULL || solidity == NULL) {
        cli_say("%s: the system refused memory", path);
        code = CLI_LIMIT;
        goto done;
    }
    print_unit(model, look.unit);
    for (size_t i = 0; i < count; ++i) {
        meshes[i] = vsh_model_mesh(model, i, -1);
    }
    CLI_TRY_DONE(cli_check_result(vsh_mesh_solidity(meshes, count, run, solidity, &error), &error));
    for (size_t i = 0; i < count; ++i) {
        if (!look.table) {
            CLI_TRY_DONE(print_mesh(model, i, &look, scale_for(model, look.unit), &solidity[i]));
        }
        if (meshes[i].uvs != NULL) {
            with_uvs[with_uv_count++] = meshes[i];
        }
    }
    CLI_TRY_DONE(print_lights(model, look.unit));
    CLI_TRY_DONE(cli_info_uvs(model, with_uvs, with_uv_count, &look, run));
    CLI_TRY_DONE(print_unwrap(meshes, count, &look, run));
    if (with_uv_count < count) {
        printf("problem: %zu of %zu meshes have no UVs to bake into: they only cast with --per-object or "
               "--no-receive; or are unwrapped\n",
               count - with_uv_count, count);
    }
done:
    free(solidity);
    free(meshes);
    free(with_uvs);
    vsh_model_free(model);
    return code;
}
