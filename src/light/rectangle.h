/* Rectangular area lights. */
#ifndef VSHI_LIGHT_RECTANGLE_H
#define VSHI_LIGHT_RECTANGLE_H

#include "light/view.h"

/* The columns of its row of light types: see light/types.h. */
void vshi_rectangle_place(const vsh_light *light, vshi_light_place *place);
double vshi_rectangle_gain(const vsh_light *light, vshi_vec to_light, double distance);
int vshi_rectangle_describe(const vsh_light *light, char *text, size_t size);
void vshi_rectangle_resize(vsh_light *light, double factor);
vsh_result vshi_rectangle_check(const vsh_light *light, vsh_error *error);

#endif
