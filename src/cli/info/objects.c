/* The objects of a mesh file at a glance, and what `bake` would say of their UVs in one image. */
#include "cli/message.h"
#include "info.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char *object_name(const vsh_mesh *mesh) {
    const char *name = mesh->object_name != NULL ? mesh->object_name : mesh->name;
    return name != NULL ? name : "";
}

void cli_info_summary(const vsh_model *model) {
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

/* "solid", "3 walls", "mixed". */
static void taken_for(const vsh_solidity_report *report, char *text, size_t capacity) {
    const struct {
        size_t count;
        const char *one, *many;
    } kinds[] = {{report->solids, "solid", "solids"},
                 {report->rooms, "room", "rooms"},
                 {report->walls, "wall", "walls"},
                 {report->open_solids, "open solid", "open solids"},
                 {report->sheets, "sheet", "sheets"}};
    size_t found = 0;
    snprintf(text, capacity, "nothing");
    for (size_t i = 0; i < sizeof kinds / sizeof kinds[0]; ++i) {
        if (kinds[i].count == 1) {
            snprintf(text, capacity, "%s", kinds[i].one);
        } else if (kinds[i].count > 1) {
            snprintf(text, capacity, "%zu %s", kinds[i].count, kinds[i].many);
        }
        found += kinds[i].count > 0;
    }
    if (found > 1) {
        snprintf(text, capacity, "mixed");
    }
}

enum { TAKEN = 64, LEAST_WIDE = 10 };

static void print_row(const vsh_model *model, size_t index, const vsh_solidity_report *solidity,
                      const vsh_uv_report *uv, int wide) {
    const vsh_mesh mesh = vsh_model_mesh(model, index, -1);
    char others[32] = "", itself[32] = "", taken[TAKEN];
    if (uv != NULL && uv->other_texels > 0) {
        snprintf(others, sizeof others, "%zu", uv->other_texels);
    }
    if (uv != NULL && uv->overlap_texels > uv->other_texels) {
        snprintf(itself, sizeof itself, "%zu", uv->overlap_texels - uv->other_texels);
    }
    taken_for(&solidity[index], taken, sizeof taken);
    printf("%10zu %8d %12s %12s %-*s %s\n", mesh.triangle_count, vsh_model_uv_sets(model, index), others,
           itself, wide, taken, mesh.name != NULL ? mesh.name : "");
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
           refused ? "problem" : "note", over, count, texels, object_name(&meshes[worst - reports]),
           worst->other_mesh_texels, object_name(&meshes[worst->other_mesh]),
           refused
               ? ": one image of all is refused; bake with --per-object, choose with --receive, or unwrap "
                 "them into one atlas"
               : "");
}

/* A line for each mesh, or where there are many only those of problems. */
static void print_uv_problems(const vsh_mesh *meshes, const vsh_uv_report *reports, size_t count) {
    for (size_t i = 0; i < count; ++i) {
        const vsh_uv_report *uv = &reports[i];
        const char *name = meshes[i].name != NULL ? meshes[i].name : "";
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

/* `reports` are of those with UVs, in their order. */
static void print_table(const vsh_model *model, const cli_info_look *look, const vsh_uv_report *reports) {
    size_t next = 0;
    int wide = LEAST_WIDE;
    for (size_t i = 0; i < vsh_model_mesh_count(model); ++i) {
        char taken[TAKEN];
        taken_for(&look->solidity[i], taken, sizeof taken);
        wide = (int)strlen(taken) > wide ? (int)strlen(taken) : wide;
    }
    printf("%10s %8s %12s %12s %-*s %s\n", "triangles", "UV sets", "over others", "over itself", wide,
           "taken for", "mesh");
    for (size_t i = 0; i < vsh_model_mesh_count(model); ++i) {
        const bool uvs = vsh_model_mesh(model, i, -1).uvs != NULL;
        print_row(model, i, look->solidity, uvs && reports != NULL ? &reports[next] : NULL, wide);
        next += uvs;
    }
    puts("(over others, over itself: texels that another object's triangle has, or one of its own)");
}

/* All meshes with UVs are one receiver, as `bake` takes them. */
int cli_info_uvs(const vsh_model *model, const vsh_mesh *meshes, size_t count, const cli_info_look *look,
                 const vsh_run *run) {
    if (count == 0) {
        if (look->table) {
            print_table(model, look, NULL);
        }
        return CLI_OK;
    }
    vsh_lightmap_options options = vsh_lightmap_options_default();
    options.width = look->width;
    options.height = look->height;
    vsh_uv_report *reports = calloc(count, sizeof *reports);
    if (reports == NULL) {
        return cli_out_of_memory("UV reports");
    }
    vsh_run quiet = *run;
    quiet.warning = NULL; /* told below */
    vsh_charts *charts = NULL;
    vsh_error error;
    int code = CLI_OK;
    if (vsh_charts_create(meshes, count, &options, &quiet, reports, &charts, &error) != VSH_OK) {
        code = cli_fail_of(NULL, &error);
    } else {
        vsh_charts_info info;
        vsh_charts_get_info(charts, &info);
        if (look->table) {
            print_table(model, look, reports);
        }
        printf("lightmap of %d × %d texels: %.1f %% covered\n", look->width, look->height,
               100.0 * (double)info.covered / ((double)look->width * look->height));
        if (!look->table) {
            print_uv_problems(meshes, reports, count);
        }
        print_verdict(meshes, reports, count, info.covered);
    }
    vsh_charts_free(charts);
    free(reports);
    return code;
}
