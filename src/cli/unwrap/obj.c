#include "cli/signals.h"
#include "cli/temporary.h"
#include "cli/try.h"
#include "unwrap.h"

#include "base/numbers.h"
#include "base/vec.h"

#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

/* A name as OBJ has them, or WHAT_INDEX: no blanks at its ends, no control characters. */
static void put_name(FILE *out, const char *name, const char *what, size_t index) {
    name = name != NULL && name[0] != '\0' ? name : NULL;
    if (name == NULL) {
        fprintf(out, "%s_%zu", what, index);
    }
    for (; name != NULL && *name != '\0'; ++name) {
        fputc((unsigned char)*name <= ' ' || *name == 0x7f ? '_' : *name, out);
    }
    fputc('\n', out);
}

static void put_vertices(FILE *out, const vsh_mesh *mesh, const vsh_atlas_mesh *placed) {
    for (size_t v = 0; v < mesh->vertex_count; ++v) {
        const vshi_vec p = vshi_transform_point(mesh->transform, vshi_vec_off(mesh->positions + 3 * v));
        fprintf(out, "v %.9g %.9g %.9g\n", p.x, p.y, p.z);
    }
    for (size_t v = 0; v < placed->vertex_count; ++v) {
        fprintf(out, "vt %.9g %.9g\n", (double)placed->uvs[2 * v], (double)placed->uvs[2 * v + 1]);
    }
    for (size_t v = 0; mesh->normals != NULL && v < mesh->vertex_count; ++v) {
        const vshi_vec n =
            vshi_unit(vshi_transform_normal(mesh->transform, vshi_vec_off(mesh->normals + 3 * v)));
        fprintf(out, "vn %.6g %.6g %.6g\n", n.x, n.y, n.z);
    }
}

/* Numbers before the first of a mesh: OBJ counts over the whole file. */
typedef struct counts {
    uint64_t positions, uvs, normals;
} counts;

static void put_face(FILE *out, const vsh_mesh *mesh, const vsh_atlas_mesh *placed, size_t triangle,
                     const counts *before) {
    const bool mirrored =
        vshi_transform_determinant(mesh->transform) < 0.0; /* faces look outwards in the world */
    fputs("f", out);
    for (size_t i = 0; i < 3; ++i) {
        const uint32_t v = placed->indices[3 * triangle + (mirrored ? 2 - i : i)];
        const uint64_t source = placed->sources[v];
        fprintf(out, " %" PRIu64 "/%" PRIu64, before->positions + source + 1, before->uvs + v + 1);
        if (mesh->normals != NULL) {
            fprintf(out, "/%" PRIu64, before->normals + source + 1);
        }
    }
    fputc('\n', out);
}

/* That of a page: of an object with its name. */
static void put_material(FILE *out, const vsh_mesh *mesh, uint32_t page, bool object) {
    const char *name = mesh->object_name != NULL ? mesh->object_name : mesh->name;
    fputs("usemtl ", out);
    put_name(out, object ? name : NULL, "page", page);
}

static void put_mesh(FILE *out, const vsh_mesh *mesh, size_t index, const vsh_atlas *atlas, bool objects,
                     counts *before) {
    const vsh_atlas_mesh placed = vsh_atlas_mesh_view(atlas, index);
    const vsh_atlas_chart *charts = vsh_atlas_charts(atlas);
    const size_t pages = vsh_atlas_page_count(atlas);
    fputs("o ", out);
    put_name(out, mesh->name, "mesh", index);
    put_vertices(out, mesh, &placed);
    uint32_t page = UINT32_MAX;
    for (size_t i = 0; i < placed.triangle_count; ++i) {
        const uint32_t chart = placed.charts[i], own = chart != VSH_NO_CHART ? charts[chart].page : 0;
        if (pages > 1 && own != page) {
            put_material(out, mesh, own, objects);
            page = own;
        }
        put_face(out, mesh, &placed, i, before);
    }
    before->positions += mesh->vertex_count;
    before->uvs += placed.vertex_count;
    before->normals += mesh->normals != NULL ? mesh->vertex_count : 0;
}

int cli_unwrap_write_obj(const char *path, const vsh_mesh *meshes, const vsh_atlas *atlas, bool objects) {
    VSHI_NUMBERS;
    cli_temporary temporary;
    counts before = {0, 0, 0};
    CLI_TRY(cli_temporary_begin(&temporary, path));
    cli_signals_writing(path);
    fprintf(temporary.file, "# vdbshade %s\n", vsh_version());
    for (size_t m = 0; m < vsh_atlas_mesh_count(atlas); ++m) {
        if (cli_interrupted()) {
            cli_temporary_abandon(&temporary);
            cli_signals_writing(NULL);
            const vsh_error cancelled = {VSH_ERROR_CANCELLED, "write: cancelled"};
            return cli_fail(&cancelled);
        }
        put_mesh(temporary.file, &meshes[m], m, atlas, objects, &before);
    }
    const int code = cli_temporary_commit(&temporary);
    cli_signals_writing(NULL);
    return code;
}
