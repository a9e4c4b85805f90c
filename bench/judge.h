/* Judges a model's lightmap for bench/assets.py: the truth, and the error of a bake. Reading models
 * and images is the library's, all else is of its own: texels, solids, rays. */
#pragma once

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <vdbshade/image.h>
#include <vdbshade/mesh.h>

#include "embree.h"

/* What truth says of a texel. */
enum {
    JUDGE_EMPTY = 0,   /* of no chart, or within a thousandth of a texel of a chart's border */
    JUDGE_VALID = 1,   /* fewer than FEW of its rays leave solids more often than they enter, or first meet a
                          room's back */
    JUDGE_INVALID = 2, /* more than MOST of them do: inside a solid, or behind a wall */
    JUDGE_UNCLEAR = 3, /* between them, or where two solids touch: not judged */
    JUDGE_VERDICTS = 4
};

enum { JUDGE_KINDS = 3 }; /* of objects in the file of solids: solids, rooms, hollows */

typedef struct judge_question {
    int32_t size; /* texels, of both sides */
    double towards[3];
    double angle; /* degrees, diameter */
    double distance;
    int32_t rays;
    int32_t every;      /* N: one texel of N is looked at, from all rows and columns */
    const char *solids; /* an OBJ of what a person takes for solids and for rooms; NULL: all are solids */
} judge_question;

/* Planes of [size × size], row 0 at v = 1. */
typedef struct judge_truth {
    float *verdict;
    float *shadow;
    float *ao;
    float *apart; /* 1 where the light is near the horizon of a bent face: shadows are judged apart there */
    float *triangle; /* 1 + number among all triangles; 0 for none */
    double units;    /* the model's size over that of the solids' file: 1 where it was read as it was meant */
} judge_truth;

/* Ends the program where anything fails. */
judge_truth judge_make(const char *model, const judge_question *question);
void judge_free(judge_truth *truth);

typedef struct judge_triangle {
    double p[3][3], n[3][3], uv[3][2]; /* n: smooth, unit; uv: NAN without UVs */
    double g[3];                       /* geometric, unit */
    double bend;                       /* radians, the largest between g and n */
    uint32_t mesh;
} judge_triangle;

/* All triangles with an area, and the box around them. */
judge_triangle *judge_take_triangles(const vsh_mesh *meshes, size_t mesh_count, size_t *count, double low[3],
                                     double high[3]);

/* Where a texel's centre lies, and the smooth normal there (which may be NULL); column and row end in a half.
 */
void judge_position(const judge_triangle *t, double column, double row, double size, double at[3],
                    double n[3]);

/* A model with its lightmap's UVs (-1: the set that a bake takes), and what of it is solid. */
typedef struct judge_scene {
    vsh_model *model;
    vsh_mesh *meshes;
    size_t mesh_count;
    judge_triangle *triangles;
    size_t count;
    truth_mesh *traced, *solids, *rooms, *hollows; /* the last two may be NULL */
    bool unknown; /* no file says what is solid: the first face that a ray meets decides */
    double lift;  /* of rays' origins along the face's normal */
    double solid_scale;
} judge_scene;

/* Ends the program where anything fails. `lift` is a share of the model's size. */
judge_scene judge_open(const char *model, const char *solids, int32_t uv_set, double lift);
void judge_close(judge_scene *scene);

/* JUDGE_VALID … JUDGE_UNCLEAR for a point of a face with the normal g. */
int judge_verdict(const judge_scene *scene, const double p[3], const double g[3]);
bool judge_hidden(const judge_scene *scene, const double from[3], const double towards[3], double reach);

typedef struct judge_shape {
    float *positions;
    uint32_t *indices;
    size_t vertices, triangles;
    double low[3], high[3];
} judge_shape;

/* "v" and "f" of an OBJ with convex faces, which are cut into fans: the faces of objects "KIND:…" only. */
judge_shape judge_read_solids(const char *path, const char *kind);

/* `vsh_judge seen`, of its arguments (judge_seen.c); returns the exit code. */
int judge_seen(int count, char **arguments);

_Noreturn void judge_give_up(const char *what, const char *why);

/* Bytes, or the end of the program. */
void *judge_take(size_t bytes);
