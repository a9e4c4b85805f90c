/* What types of lights there are and what each is given by: the one table that checks, scene files, texts and
 * whoever marches or traces towards lights go by. */
#ifndef VSHI_LIGHT_TYPES_H
#define VSHI_LIGHT_TYPES_H

#include "light/view.h"

#include <stdint.h>

typedef struct vshi_light_type {
    const char *name; /* in scene files */
    bool falls_off;   /* has `falloff` and `reach` */
    /* Where it is and how large, in world space. */
    void (*place)(const vsh_light *light, vshi_light_place *place);
    /* See vshi_light_gain(). */
    double (*gain)(const vsh_light *light, vshi_vec to_light, double distance);
    /* Type, place and size in words. */
    int (*describe)(const vsh_light *light, char *text, size_t size);
    /* Makes it so many times as large as a point sees it. */
    void (*resize)(vsh_light *light, double factor);
    /* What no range of a member tells; NULL: nothing. */
    vsh_result (*check)(const vsh_light *light, vsh_error *error);
} vshi_light_type;

/* NULL: there is no such type. */
const vshi_light_type *vshi_light_type_of(int32_t type);

/* The bits, 1 << type, of the types that fall off with the distance, and of those of a plane. */
uint32_t vshi_light_types_falling(void);
uint32_t vshi_light_types_flat(void);

typedef enum vshi_light_kind {
    VSHI_LIGHT_NUMBER, /* double */
    VSHI_LIGHT_ANGLE,  /* double, radians; in files degrees */
    VSHI_LIGHT_VECTOR, /* double[3]; of a plane two of them */
    VSHI_LIGHT_SWITCH  /* int32_t, 0 or 1 */
} vshi_light_kind;

/* A member of vsh_light that lights of some types have. */
typedef struct vshi_light_member {
    const char *name; /* in C, for messages */
    const char *key;  /* in scene files */
    vshi_light_kind kind;
    uint32_t types;    /* bits */
    uint32_t required; /* in files: bits */
    size_t offset;
    double lowest,
        highest;       /* of switches 0 and 1; infinity as an excluded end stands for: any finite value */
    bool above, below; /* ends that are excluded */
    bool nonzero;      /* of vectors: not all of the numbers may be 0 */
    bool apart;        /* its type's check() has its range, which another member decides */
} vshi_light_member;

extern const vshi_light_member vshi_light_members[];
extern const size_t vshi_light_member_count;

/* The columns of rectangles (rectangle.c). */
void vshi_rectangle_place(const vsh_light *light, vshi_light_place *place);
double vshi_rectangle_gain(const vsh_light *light, vshi_vec to_light, double distance);
int vshi_rectangle_describe(const vsh_light *light, char *text, size_t size);
void vshi_rectangle_resize(vsh_light *light, double factor);
vsh_result vshi_rectangle_check(const vsh_light *light, vsh_error *error);

#endif
