/* Transforms: the steps inside <transform> apply one after another, M = T_n ... T_1. */
#include "import/importer.h"

#include "base/text.h"
#include "import/number.h"

#include <string.h>

bool ca_import_numbers(ca_importer *importer, const ca_xml_node *node, const char *attribute, double *numbers,
                       size_t count)
{
    const char *text = ca_xml_attribute_value(node, attribute);
    const char *cursor = text, *token;
    size_t found = 0;
    for (size_t length; (length = ca_next_token(&cursor, &token)) > 0; found++) {
        if (found >= count || ca_parse_number(token, length, &numbers[found])) continue;
        ca_import_fail(importer, &node->where, "\"%.*s\" is no finite number", (int)(length < 60 ? length : 60),
                       token);
        return false;
    }
    if (count == 1 && strchr(text, ',')) { /* "0,5" is two of a list, and ",5" none */
        ca_import_fail(importer, &node->where, "\"%.60s\" is no finite number; decimals have a point", text);
        return false;
    }
    if (found == count) return true;
    ca_import_fail(importer, &node->where, "<%s> needs %zu number%s in \"%s\", not \"%.60s\"", node->tag, count,
                   ca_noun((double)count, "", "s"), attribute, text);
    return false;
}

static size_t count_tokens(const char *text)
{
    const char *token;
    size_t count = 0;
    while (ca_next_token(&text, &token) > 0) count++;
    return count;
}

void ca_import_xyz(ca_importer *importer, const ca_xml_node *node, double fallback, double xyz[3])
{
    static const char *const names[3] = {"x", "y", "z"};
    const char *value = ca_xml_attribute_value(node, "value");
    for (int i = 0; i < 3; i++) {
        xyz[i] = fallback;
        if (!ca_xml_attribute_value(node, names[i])) continue;
        if (value) ca_import_fail(importer, &node->where, "<%s> has both %s and value", node->tag, names[i]);
        ca_import_numbers(importer, node, names[i], &xyz[i], 1);
    }
    if (!value) return;
    if (count_tokens(value) != 1) {
        ca_import_numbers(importer, node, "value", xyz, 3);
    } else if (ca_import_numbers(importer, node, "value", xyz, 1)) {
        xyz[1] = xyz[2] = xyz[0];
    }
}

static ca_matrix rotation(ca_importer *importer, const ca_xml_node *node)
{
    double axis[3], angle = 0.0;
    ca_import_xyz(importer, node, 0.0, axis);
    ca_import_numbers(importer, node, "angle", &angle, 1);
    const double length2 = axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2];
    if (length2 > 0.0 && isfinite(length2)) return ca_matrix_rotate(axis[0], axis[1], axis[2], angle);
    ca_import_fail(importer, &node->where, "<rotate> needs an axis, and it is 0");
    return ca_matrix_identity();
}

/* Some vector across the given one: for a <lookat> that does not care what is up. */
static void any_up(const double origin[3], const double target[3], double up[3])
{
    int smallest = 0;
    for (int i = 0; i < 3; i++) {
        if (fabs(target[i] - origin[i]) < fabs(target[smallest] - origin[smallest])) smallest = i;
        up[i] = 0.0;
    }
    up[smallest] = 1.0;
}

static ca_matrix look_at(ca_importer *importer, const ca_xml_node *node)
{
    double origin[3], target[3], up[3] = {0.0, 0.0, 0.0};
    ca_matrix result = ca_matrix_identity();
    if (!ca_import_numbers(importer, node, "origin", origin, 3) ||
        !ca_import_numbers(importer, node, "target", target, 3))
        return result;
    if (ca_xml_attribute_value(node, "up") && !ca_import_numbers(importer, node, "up", up, 3)) return result;
    if (up[0] == 0.0 && up[1] == 0.0 && up[2] == 0.0) any_up(origin, target, up);
    if (!ca_matrix_look_at(origin, target, up, &result))
        ca_import_fail(importer, &node->where, "<lookat> needs origin, target and up that are not on one line");
    return result;
}

/* 16 numbers, or the 9 of the upper left 3x3. */
static ca_matrix matrix(ca_importer *importer, const ca_xml_node *node)
{
    ca_matrix result = ca_matrix_identity();
    const bool small = count_tokens(ca_xml_attribute_value(node, "value")) == 9;
    const int size = small ? 3 : 4;
    double numbers[16];
    if (!ca_import_numbers(importer, node, "value", numbers, small ? 9 : 16)) return result;
    for (int row = 0; row < size; row++)
        for (int column = 0; column < size; column++) result.m[row][column] = numbers[row * size + column];
    return result;
}

static ca_matrix step(ca_importer *importer, const ca_xml_node *node)
{
    double v[3];
    switch (node->tag[0]) {
    case 'm': return matrix(importer, node);
    case 'l': return look_at(importer, node);
    case 'r': return rotation(importer, node);
    case 't': ca_import_xyz(importer, node, 0.0, v); return ca_matrix_translate(v[0], v[1], v[2]);
    default: ca_import_xyz(importer, node, 1.0, v); return ca_matrix_scale(v[0], v[1], v[2]);
    }
}

ca_matrix ca_import_transform(ca_importer *importer, const ca_xml_node *node)
{
    ca_matrix result = ca_matrix_identity();
    for (const ca_xml_node *child = node->first_child; child && ca_import_good(importer); child = child->next) {
        const ca_matrix next = step(importer, child);
        result = ca_matrix_multiply(&next, &result);
    }
    if (!ca_import_good(importer)) return ca_matrix_identity();
    ca_affine affine;
    if (ca_affine_from_matrix(&result, &affine)) return result;
    ca_import_fail(importer, &node->where, "this transform is singular, not affine or not finite");
    return ca_matrix_identity();
}

/* M^T M is a multiple of the identity; *scale becomes the length of the first column. */
static bool is_similarity(const ca_matrix *m, double *scale)
{
    double products[3][3];
    for (int a = 0; a < 3; a++)
        for (int b = 0; b < 3; b++) {
            products[a][b] = 0.0;
            for (int row = 0; row < 3; row++) products[a][b] += m->m[row][a] * m->m[row][b];
        }
    *scale = sqrt(products[0][0]);
    for (int a = 0; a < 3; a++)
        for (int b = 0; b < 3; b++)
            if (!(fabs(products[a][b] - (a == b ? products[0][0] : 0.0)) <= 1e-3 * products[0][0])) return false;
    return true;
}

bool ca_import_is_similarity(const ca_matrix *m)
{
    double scale;
    return is_similarity(m, &scale);
}

bool ca_import_make_similarity(ca_matrix *m)
{
    double scale = 0.0;
    ca_matrix rigid = *m;
    if (!is_similarity(m, &scale)) return false;
    for (int i = 0; i < 9; i++) rigid.m[i / 3][i % 3] /= scale;
    if (!ca_matrix_make_rigid(&rigid)) return false;
    scale = 0.0; /* the nearest one: a third of the trace of R^T M */
    for (int i = 0; i < 9; i++) scale += rigid.m[i / 3][i % 3] * m->m[i / 3][i % 3] / 3.0;
    for (int i = 0; i < 9; i++) m->m[i / 3][i % 3] = scale * rigid.m[i / 3][i % 3];
    return true;
}

bool ca_import_make_rigid(ca_matrix *m)
{
    double scale;
    return is_similarity(m, &scale) && fabs(scale - 1.0) <= 1e-3 && ca_matrix_make_rigid(m);
}
