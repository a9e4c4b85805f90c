/* What shadows are measured on, of assets/: meshes and receivers all over them, and the seeds over their
 * floor. */
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
    vsh_mesh *meshes; /* views into the model */
    size_t mesh_count;
    vsh_model *model;
} bench_scene;

/* Ends the program where the asset or memory is missing. */
void bench_scene_make(int which, bench_scene *scene);
void bench_scene_free(bench_scene *scene);

/* The scene's field, `resolution` voxels along its longest side. */
vsh_field *bench_scene_field(const bench_scene *scene, int32_t resolution);

/* Points of a 1024² lightmap in its own order, in runs of 64 from all over it, the first chosen by `seed`:
 * positions [count][3], geometric normals [count][3], valid [count], 0 for those that the field has inside
 * other geometry, as a bake judges. */
void bench_scene_points(const bench_scene *scene, const vsh_field *field, uint64_t seed, size_t count,
                        double *positions, float *normals, float *valid);

/* The seeds' scene: its field, its sun, and 512² texels of the floor. */
typedef struct bench_seeds_scene {
    vsh_grid *grid;
    vsh_field *field;
    vsh_light sun;
    size_t count;
    double *positions; /* [count][3], a thousandth above the floor, in the order of a lightmap's samples */
    float *normals;    /* [count][3] */
} bench_seeds_scene;

/* Ends the program where the asset or memory is missing. */
void bench_seeds_make(bench_seeds_scene *seeds);
void bench_seeds_free(bench_seeds_scene *seeds);

#endif
