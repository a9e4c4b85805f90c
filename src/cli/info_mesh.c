#include "info.h"
#include "message.h"

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <vdbshade/vdbshade.h>

enum { UV_REPORT_SIZE = 1024 };

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
    print_kind(report->sheets, "sheet with air on both sides", "sheets with air on both sides", &first);
    puts(first ? "nothing" : "");
    if (report->closed_over > 0) {
        printf("  closed over: %zu hole%s with %zu open edges, of %zu of these\n", report->holes,
               report->holes == 1 ? "" : "s", report->open_edges, report->closed_over);
    }
    print_count(report->turned_triangles, "triangles that face the other way than those around");
}

static int print_mesh(const vsh_model *model, size_t index, const vsh_solidity_report *solidity) {
    const vsh_mesh mesh = vsh_model_mesh(model, index, -1);
    vsh_mesh_report report;
    vsh_error error;
    if (vsh_mesh_check(&mesh, &report, &error) != VSH_OK) {
        return cli_fail(&error);
    }
    printf("mesh %zu '%s'\n", index, name_of(&mesh));
    printf("  triangles: %zu\n  vertices: %zu\n", mesh.triangle_count, mesh.vertex_count);
    printf("  UV sets: %d\n  normals: %s\n", vsh_model_uv_sets(model, index),
           mesh.normals != NULL ? "yes" : "no, flat");
    printf("  bounds: %g %g %g to %g %g %g\n  area: %g\n", report.bounds_min[0], report.bounds_min[1],
           report.bounds_min[2], report.bounds_max[0], report.bounds_max[1], report.bounds_max[2],
           report.area);
    print_count(report.open_edges, "open edges");
    print_count(report.flipped_edges, "edges whose triangles disagree about the outside");
    print_count(report.degenerate_triangles, "triangles of zero area, which are skipped");
    print_solidity(solidity);
    return CLI_OK;
}

/* All meshes with UVs are one receiver, as `bake` takes them. */
static int print_uvs(const vsh_mesh *meshes, size_t count) {
    vsh_lightmap_options options = vsh_lightmap_options_default();
    options.width = UV_REPORT_SIZE;
    options.height = UV_REPORT_SIZE;
    vsh_uv_report *reports = calloc(count, sizeof *reports);
    if (reports == NULL) {
        cli_say("UV reports: the system refused memory");
        return CLI_LIMIT;
    }
    const vsh_run run = vsh_run_default();
    vsh_texels *texels = NULL;
    vsh_error error;
    if (vsh_texels_create(meshes, count, &options, &run, reports, &texels, &error) != VSH_OK) {
        free(reports);
        return cli_fail(&error);
    }
    vsh_texels_info info;
    vsh_texels_get_info(texels, &info);
    printf("lightmap of %d × %d texels: %.1f %% covered\n", UV_REPORT_SIZE, UV_REPORT_SIZE,
           100.0 * (double)info.covered / ((double)UV_REPORT_SIZE * UV_REPORT_SIZE));
    for (size_t i = 0; i < count; ++i) {
        const vsh_uv_report *uv = &reports[i];
        if (uv->overlap_texels > 0) {
            printf("  problem: mesh '%s': %zu texels of %zu triangles lie over other charts\n",
                   name_of(&meshes[i]), uv->overlap_texels, uv->overlap_triangles);
        }
        if (uv->outside_triangles > 0) {
            printf("  problem: mesh '%s': %zu triangles leave the UV square\n", name_of(&meshes[i]),
                   uv->outside_triangles);
        }
        if (uv->degenerate_triangles > 0) {
            printf("  problem: mesh '%s': %zu triangles have no area in the UV set\n", name_of(&meshes[i]),
                   uv->degenerate_triangles);
        }
    }
    vsh_texels_free(texels);
    free(reports);
    return CLI_OK;
}

int cli_info_mesh(const char *path, const vsh_run *run) {
    vsh_model *model = NULL;
    vsh_error error;
    if (vsh_model_read(path, run, &model, &error) != VSH_OK) {
        return cli_fail(&error);
    }
    const size_t count = vsh_model_mesh_count(model);
    vsh_mesh *with_uvs = calloc(count, sizeof *with_uvs);
    size_t with_uv_count = 0;
    vsh_mesh *meshes = calloc(count, sizeof *meshes);
    vsh_solidity_report *solidity = calloc(count, sizeof *solidity);
    int code = CLI_OK;
    if (with_uvs == NULL || meshes == NULL || solidity == NULL) {
        cli_say("%s: the system refused memory", path);
        code = CLI_LIMIT;
    }
    for (size_t i = 0; i < count && code == CLI_OK; ++i) {
        meshes[i] = vsh_model_mesh(model, i, -1);
    }
    if (code == CLI_OK && vsh_mesh_solidity(meshes, count, run, solidity, &error) != VSH_OK) {
        code = cli_fail(&error);
    }
    for (size_t i = 0; i < count && code == CLI_OK; ++i) {
        code = print_mesh(model, i, &solidity[i]);
        const vsh_mesh mesh = vsh_model_mesh(model, i, -1);
        if (mesh.uvs != NULL) {
            with_uvs[with_uv_count++] = mesh;
        }
    }
    if (code == CLI_OK && with_uv_count < count) {
        printf("problem: %zu of %zu meshes have no UVs to bake into\n", count - with_uv_count, count);
    }
    if (code == CLI_OK && with_uv_count > 0) {
        code = print_uvs(with_uvs, with_uv_count);
    }
    free(solidity);
    free(meshes);
    free(with_uvs);
    vsh_model_free(model);
    return code;
}
