/* One scene in every format that is read, as Blender 3.4 writes it (tools/modelling/export_models.py): the
 * same triangles in the same places. */
#include "handles.h"
#include "models.h"

typedef struct sums {
    size_t triangles;
    double area, min[3], max[3];
    double uv[2][3]; /* of both sets: the area of UVs, and the centre of U and V by area in the world */
    double blended;  /* area */
} sums;

static void add_uvs(const vsh_mesh *mesh, double *sum) {
    for (size_t i = 0; i < mesh->triangle_count && mesh->uvs != NULL; ++i) {
        const uint32_t *v = mesh->indices + 3 * i;
        const float *a = mesh->uvs + 2 * (size_t)v[0], *b = mesh->uvs + 2 * (size_t)v[1],
                    *c = mesh->uvs + 2 * (size_t)v[2];
        vshi_vec corner[3];
        vshi_mesh_triangle(mesh, i, corner);
        const double area =
            vshi_length(vshi_cross(vshi_sub(corner[1], corner[0]), vshi_sub(corner[2], corner[0])));
        sum[0] += ((double)b[0] - (double)a[0]) * ((double)c[1] - (double)a[1]) -
                  ((double)b[1] - (double)a[1]) * ((double)c[0] - (double)a[0]);
        for (int k = 0; k < 2; ++k) {
            sum[1 + k] += area * ((double)a[k] + (double)b[k] + (double)c[k]);
        }
    }
}

static sums sums_of(const char *name, double unit) {
    char path[512];
    snprintf(path, sizeof path, "%s/%s", VSH_MODELS, name);
    OWNED(vsh_model) *model = model_from(path);
    assert_that(fabs(vsh_model_unit(model) - unit) <= 1e-12, "%s: a unit of %g m, expected %g", name,
                vsh_model_unit(model), unit);
    sums s = {.min = {1e9, 1e9, 1e9}, .max = {-1e9, -1e9, -1e9}};
    for (size_t i = 0; i < vsh_model_mesh_count(model); ++i) {
        const vsh_mesh_report report = check(model, i);
        const vsh_mesh mesh = vsh_model_mesh(model, i, 0);
        s.triangles += mesh.triangle_count - report.degenerate_triangles;
        s.area += report.area;
        s.blended += mesh.alpha == VSH_ALPHA_BLENDED ? report.area : 0.0;
        for (int k = 0; k < 3; ++k) {
            s.min[k] = fmin(s.min[k], report.bounds_min[k]);
            s.max[k] = fmax(s.max[k], report.bounds_max[k]);
        }
        for (int32_t set = 0; set < 2; ++set) {
            const vsh_mesh view = vsh_model_mesh(model, i, set);
            add_uvs(&view, s.uv[set]);
        }
    }
    return s;
}

static void expect(const char *name, const char *what, double value, double expected) {
    assert_that(fabs(value - expected) <= 2e-5 * (1.0 + fabs(expected)), "%s: %s %.9g, expected %.9g", name,
                what, value, expected);
}

/* The scene has 12 triangles of the box and 4 of the L, and no area over the L's void. */
TEST(one_scene_is_the_same_in_every_format) {
    static const struct {
        const char *name;
        double unit;
        int uv_sets;
        bool alpha, z_up;
    } files[] = {
        {"scene.glb", 1.0, 2, true, false},       {"scene.gltf", 1.0, 2, true, false},
        {"scene_draco.glb", 1.0, 2, true, false}, /* the same through gltf-transform's Draco, 24 bits */
        {"scene.fbx", 0.01, 2, true, false},      {"scene.dae", 1.0, 2, true, false},
        {"scene.obj", 0.0, 1, true, false},       {"scene.ply", 0.0, 1, false, true},
        {"scene_ascii.ply", 0.0, 1, false, true}, {"scene.stl", 0.0, 0, false, true},
        {"scene_ascii.stl", 0.0, 0, false, true},
    };
    const sums truth = sums_of("scene.glb", 1.0);
    expect("scene.glb", "area", truth.area, 30.0);
    expect("scene.glb", "lowest y", truth.min[1], 2.0);
    expect("scene.glb", "area of glass", truth.blended, 4.0);
    for (size_t i = 0; i < COUNT_OF(files); ++i) {
        const char *name = files[i].name;
        const sums s = sums_of(name, files[i].unit);
        /* Blender writes PLY and STL with z up: its y is then minus the others' z */
        const double min[3] = {s.min[0], files[i].z_up ? s.min[2] : s.min[1],
                               files[i].z_up ? -s.max[1] : s.min[2]};
        const double max[3] = {s.max[0], files[i].z_up ? s.max[2] : s.max[1],
                               files[i].z_up ? -s.min[1] : s.max[2]};
        expect(name, "triangles", (double)s.triangles, 16.0);
        expect(name, "area", s.area, truth.area);
        for (int k = 0; k < 3; ++k) {
            expect(name, "lowest", min[k], truth.min[k]);
            expect(name, "highest", max[k], truth.max[k]);
        }
        for (int set = 0; set < files[i].uv_sets; ++set) {
            for (int k = 0; k < 3 && strstr(name, "ply") == NULL; ++k) { /* PLY has UVs by vertex */
                expect(name, "UVs", s.uv[set][k], truth.uv[set][k]);
            }
        }
        expect(name, "area of glass", s.blended, files[i].alpha ? truth.blended : 0.0);
    }
}

/* A bar on two bones, the upper bent by a right angle: Blender's own vertices of the tip. */
TEST(a_figure_stands_as_its_bones_do) {
    static const char *const names[] = {"figure.glb", "figure.fbx"};
    for (size_t i = 0; i < 2; ++i) {
        const sums s = sums_of(names[i], i == 0 ? 1.0 : 0.01);
        static const double min[3] = {2.9, 0.0, -0.1}, max[3] = {3.1, 1.1, 1.0};
        expect(names[i], "triangles", (double)s.triangles, 20.0);
        for (int k = 0; k < 3; ++k) {
            expect(names[i], "lowest", s.min[k], min[k]);
            expect(names[i], "highest", s.max[k], max[k]);
        }
    }
}
