/* Judges a model's lightmap for bench/assets.py: the truth, and the error of a bake. The
 * library reads models and images. Texels, solids and rays are independent of its code. */
#pragma once

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <vdbshade/image.h>
#include <vdbshade/mesh.h>

#include "embree.h"

/* Verdict of the truth on a texel. */
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
    int32_t every;      /* judges one texel of N, in all rows and columns */
    const char *solids; /* an OBJ with the objects that a person calls solid or room; NULL: all solid */
} judge_question;

/* Planes of [size × size], row 0 at v = 1. */
typedef struct judge_truth {
    float *verdict;
    float *shadow;
    float *ao;
    float *apart;    /* 1 if the light is near the horizon of a bent face: judged separately */
    float *triangle; /* 1 + number among all triangles; 0 for none */
    double units;    /* the model's size over that of the solids' file: 1 if units are right */
} judge_truth;

/* Ends the program on any error. */
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

/* Position and smooth normal (may be NULL) of a texel's centre; column and row end in a half. */
void judge_position(const judge_triangle *t, double column, double row, double size, double at[3],
                    double n[3]);

/* A model with its lightmap's UVs (-1: the default set) and its solids. */
typedef struct judge_scene {
    vsh_model *model;
    vsh_mesh *meshes;
    size_t mesh_count;
    judge_triangle *triangles;
    size_t count;
    truth_mesh *traced, *solids, *rooms, *hollows; /* the last two may be NULL */
    bool unknown; /* no file of solids: the first face that a ray meets decides */
    double lift;  /* of rays' origins along the face's normal */
    double solid_scale;
} judge_scene;

/* Ends the program on any error. `lift` is a share of the model's size. */
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

/* Runs `vsh_judge seen` (judge_seen.c); returns the exit code. */
int judge_seen(int count, char **arguments);

_Noreturn void judge_give_up(const char *what, const char *why);

/* Allocates zeroed bytes, or ends the program. */
void *judge_take(size_t bytes);
