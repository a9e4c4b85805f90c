/* Cosine-weighted rays of a piece of points, on their way: marched against the field, or traced. */
#ifndef VSHI_AO_RAYS_H
#define VSHI_AO_RAYS_H

#include "shade/ao.h"
#include "trace/embree.h"

enum { VSHI_AO_BALLS = 4 };

/* A ball around a place up the normal that the field says is free. */
typedef struct vshi_ao_ball {
    double height, square; /* of its centre over the origin; its radius, squared */
} vshi_ao_ball;

typedef struct vshi_ao_point {
    vshi_ao_frame frame;
    bool traced;     /* not exact: its rays meet the field's surface; else they are marched */
    vshi_lean lean;  /* of the plane that limits its directions */
    vshi_vec mirror; /* face at which directions below it are mirrored, along the axes; zero: none are */
    size_t index;    /* of the task's points */
    uint32_t texel;
    int32_t taken, free; /* rays */
    int32_t next;        /* rays after this round; 0: done */
    vshi_vec open;       /* sum of the directions of the free; exact: in world space, else in the field's */
    vshi_vec all;        /* of all, along the frame's axes */
    int32_t balls;       /* the smallest first */
    vshi_ao_ball ball[VSHI_AO_BALLS];
    vshi_vec world_origin, world_axes[3]; /* exact */
} vshi_ao_point;

/* Points of a piece and their rays. */
typedef struct vshi_ao_piece {
    const vshi_ao_task *task;
    bool exact;
    bool tiled; /* the points are texels of one tile */
    size_t count;
    vshi_ao_point points[VSHI_AO_GRAIN];
    vshi_chunk chunk;
    size_t traced;
    vshi_vec directions[VSHI_CHUNK]; /* exact: world space, else the field's */
    double begin[VSHI_CHUNK];        /* up to where a ray is known to be free */
    uint16_t owner[VSHI_CHUNK];      /* the point of each */
    uint8_t
        key[VSHI_CHUNK]; /* of a tile: where each goes to, so that those that go alike are traced together;
                          * of others 0: the order of a point's rays depends on no other point */
} vshi_ao_piece;

/* Points of the task, VSHI_AO_GRAIN at most, `next` being `first` for those that have something to shoot. The
 * values of the others are known, and set. */
void vshi_ao_piece_open(vshi_ao_piece *piece, const vshi_ao_task *task, const size_t *points, size_t count,
                        bool tiled, int32_t first, vsh_shade_stats *stats);

/* Shoots rays for each point until it has `next`. */
void vshi_ao_piece_shoot(vshi_ao_piece *piece, vsh_shade_stats *stats);

/* The mean of a point's open directions, as of vshi_ao_task.bent, world space. */
vshi_vec vshi_ao_piece_bent(const vshi_ao_piece *piece, const vshi_ao_point *point);

#endif
