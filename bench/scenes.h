/* The meshes that shadows are measured on, and receivers all over them. */
#ifndef BENCH_SCENES_H
#define BENCH_SCENES_H

#include <stddef.h>
#include <stdint.h>
#include <vdbshade/vdbshade.h>

enum {
    BENCH_CLOISTER, /* the sample asset */
    BENCH_SMOOTH,   /* a lobed ring of some 50 000 triangles over a plate */
    BENCH_THIN,     /* posts, slats and a sheet for a roof, over a floor */
    BENCH_SCENES
};

typedef struct bench_scene {
    const char *name;
    vsh_mesh *meshes;
    size_t mesh_count;
    /* what they are views of */
    vsh_model *model;
    float *positions;
    uint32_t *indices;
    vsh_mesh one;
} bench_scene;

/* Ends the program where the asset or memory is missing. */
void bench_scene_make(int which, bench_scene *scene);
void bench_scene_free(bench_scene *scene);

/* Points uniform in area over all triangles, the same on every machine: positions [count][3], normals
 * [count][3], valid [count], 0 for those that the field has inside other geometry, as a bake judges. */
void bench_scene_points(const bench_scene *scene, const vsh_field *field, uint64_t seed, size_t count,
                        double *positions, float *normals, float *valid);

#endif
