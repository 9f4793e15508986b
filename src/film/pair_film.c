#include "film/pair_film.h"

#include "base/memory.h"

#include <assert.h>

_Static_assert(sizeof(ca_pair_pixel) + sizeof(ca_pair_moments) == 208, "pair_film.h promises 208 bytes a pixel");
_Static_assert(sizeof(ca_pair_connections) == 320, "pair_film.h promises 320 bytes a pixel");
_Static_assert(sizeof(ca_pair_means) == 40, "pair_film.h promises 40 bytes a pixel");
_Static_assert(sizeof(ca_pair_means) + sizeof(ca_pair_connected_means) + sizeof(ca_pair_moments) == 168,
               "pair_film.h promises 168 bytes a pixel");
_Static_assert((int)CA_PAIR_OTHER_MEANS_BYTES == (int)(sizeof(ca_pair_means) + sizeof(ca_pair_connected_means)),
               "pair_film.h tells the bytes of means");

static ca_pair_film empty_film(const uint32_t crop[4])
{
    return (ca_pair_film){.x0 = crop[0], .y0 = crop[1], .width = crop[2] - crop[0], .height = crop[3] - crop[1]};
}

ca_status ca_pair_film_create(ca_pair_film *film, const uint32_t crop[4], uint32_t light_paths, uint32_t camera_paths,
                              ca_error *error)
{
    *film = empty_film(crop);
    film->light_paths = light_paths;
    film->camera_paths = camera_paths;
    film->pixels = ca_alloc_zeroed((size_t)film->width * film->height, sizeof *film->pixels);
    film->made = ca_alloc_zeroed((size_t)film->width * film->height, sizeof *film->made);
    return film->pixels && film->made ? CA_OK : ca_fail_memory(error, "the noise components");
}

ca_status ca_pair_film_create_means(ca_pair_film *film, const uint32_t crop[4], ca_error *error)
{
    *film = empty_film(crop);
    film->means = ca_alloc_zeroed((size_t)film->width * film->height, sizeof *film->means);
    return film->means ? CA_OK : ca_fail_memory(error, "the noise components");
}

ca_status ca_pair_film_connect(ca_pair_film *film, ca_error *error)
{
    const size_t pixels = (size_t)film->width * film->height;
    for (uint32_t i = 0; i < film->other_count; i++) CA_TRY(ca_pair_film_connect(&film->others[i], error));
    if (film->means) {
        if (!film->connected_means) film->connected_means = ca_alloc_zeroed(pixels, sizeof *film->connected_means);
    } else if (!film->connections) {
        film->connections = ca_alloc_zeroed(pixels, sizeof *film->connections);
    }
    return film->connections || film->connected_means ? CA_OK : ca_fail_memory(error, "the noise components");
}

ca_status ca_pair_film_add_others(ca_pair_film *film, const ca_pair_numbers *numbers, uint32_t count, ca_error *error)
{
    const uint32_t crop[4] = {film->x0, film->y0, film->x0 + film->width, film->y0 + film->height};
    assert(!film->connections && !film->connected_means && !film->others);
    film->others = ca_alloc_zeroed(count, sizeof *film->others);
    if (!film->others) return ca_fail_memory(error, "the noise components");
    film->other_count = count;
    for (uint32_t i = 0; i < count; i++) {
        ca_pair_film *other = &film->others[i];
        CA_TRY(ca_pair_film_create_means(other, crop, error));
        other->light_paths = numbers[i].light_paths;
        other->camera_paths = numbers[i].camera_paths;
        if (!film->made) continue;
        other->made = ca_alloc_zeroed((size_t)film->width * film->height, sizeof *other->made);
        if (!other->made) return ca_fail_memory(error, "the noise components");
    }
    return CA_OK;
}

void ca_pair_film_destroy(ca_pair_film *film)
{
    for (uint32_t i = 0; i < film->other_count; i++) ca_pair_film_destroy(&film->others[i]);
    ca_free(film->others);
    ca_free(film->pixels);
    ca_free(film->means);
    ca_free(film->connected_means);
    ca_free(film->connections);
    ca_free(film->made);
    *film = (ca_pair_film){0};
}

static void add_connections(ca_pair_connections *sums, const double quantities[CA_PAIR_ALL_QUANTITIES])
{
    for (int b = CA_PAIR_QUANTITIES; b < CA_PAIR_ALL_QUANTITIES; b++) {
        sums->sums[b - CA_PAIR_QUANTITIES] += quantities[b];
        for (int a = 0; a <= b; a++) sums->products[ca_pair_connected_product(a, b)] += quantities[a] * quantities[b];
    }
}

static void add_means(ca_pair_film *film, size_t number, const ca_pair_moments *moments)
{
    ca_pair_means *means = &film->means[number];
    means->sums[CA_PAIR_VALUE] += moments->value;
    means->sums[CA_PAIR_PAIR] += moments->pair;
    means->sums[CA_PAIR_CAMERA] += moments->camera;
    means->sums[CA_PAIR_LIGHT] += moments->light;
    means->squares += moments->value * moments->value;
    if (!film->connected_means) return;
    ca_pair_connected_means *connected = &film->connected_means[number];
    const double sums[] = {moments->connected, moments->connected_square, moments->connected_pair,
                           moments->connected_camera, moments->connected_light};
    for (size_t q = 0; q < sizeof sums / sizeof sums[0]; q++) connected->sums[q] += sums[q];
    connected->cross += moments->value * moments->connected;
    connected->squares += moments->connected * moments->connected;
}

static void add_products(ca_pair_film *film, size_t number, const ca_pair_moments *moments)
{
    ca_pair_pixel *pixel = &film->pixels[number];
    const double quantities[CA_PAIR_ALL_QUANTITIES] = {[CA_PAIR_VALUE] = moments->value,
                                                       [CA_PAIR_PAIR] = moments->pair,
                                                       [CA_PAIR_CAMERA] = moments->camera,
                                                       [CA_PAIR_LIGHT] = moments->light,
                                                       [CA_PAIR_CONNECTED] = moments->connected,
                                                       [CA_PAIR_CONNECTED_SQUARE] = moments->connected_square,
                                                       [CA_PAIR_CONNECTED_PAIR] = moments->connected_pair,
                                                       [CA_PAIR_CONNECTED_CAMERA] = moments->connected_camera,
                                                       [CA_PAIR_CONNECTED_LIGHT] = moments->connected_light};
    const double square = moments->value * moments->value;
    for (int a = 0; a < CA_PAIR_QUANTITIES; a++) {
        pixel->sums[a] += quantities[a];
        for (int b = a; b < CA_PAIR_QUANTITIES; b++)
            pixel->products[ca_pair_product(a, b)] += quantities[a] * quantities[b];
    }
    pixel->cubes += square * moments->value;
    pixel->fourths += square * square;
    pixel->iterations++;
    if (film->connections) add_connections(&film->connections[number], quantities);
}

static size_t number_of(const ca_pair_film *film, uint32_t x, uint32_t y)
{
    assert(x >= film->x0 && x - film->x0 < film->width && y >= film->y0 && y - film->y0 < film->height);
    return (size_t)(y - film->y0) * film->width + (x - film->x0);
}

void ca_pair_film_add(ca_pair_film *film, uint32_t x, uint32_t y, const ca_pair_moments *moments)
{
    const size_t number = number_of(film, x, y);
    if (film->means)
        add_means(film, number, moments);
    else
        add_products(film, number, moments);
}

void ca_pair_film_hold(ca_pair_film *film, uint32_t x, uint32_t y, const ca_pair_moments *moments)
{
    if (film->made)
        film->made[number_of(film, x, y)] = *moments;
    else
        ca_pair_film_add(film, x, y, moments);
}

void ca_pair_film_commit(ca_pair_film *film, uint32_t x, uint32_t y)
{
    if (film->made) ca_pair_film_add(film, x, y, &film->made[number_of(film, x, y)]);
    for (uint32_t i = 0; i < film->other_count; i++) ca_pair_film_commit(&film->others[i], x, y);
}

static void pool_means(ca_pair_film *film, const ca_pair_film *other, int sign)
{
    for (size_t p = 0; p < (size_t)film->width * film->height; p++) {
        for (int q = 0; q < CA_PAIR_QUANTITIES; q++) film->means[p].sums[q] += sign * other->means[p].sums[q];
        film->means[p].squares += sign * other->means[p].squares;
    }
    for (size_t p = 0; film->connected_means && p < (size_t)film->width * film->height; p++) {
        ca_pair_connected_means *to = &film->connected_means[p];
        const ca_pair_connected_means *from = &other->connected_means[p];
        for (size_t q = 0; q < sizeof to->sums / sizeof to->sums[0]; q++) to->sums[q] += sign * from->sums[q];
        to->cross += sign * from->cross;
        to->squares += sign * from->squares;
    }
    for (uint32_t i = 0; i < film->other_count; i++) pool_means(&film->others[i], &other->others[i], sign);
}

void ca_pair_film_pool(ca_pair_film *film, const ca_pair_film *other, int sign)
{
    assert(film->width == other->width && film->height == other->height && !film->connections);
    assert((film->means != NULL) == (other->means != NULL) && film->other_count == other->other_count);
    assert((film->connected_means != NULL) == (other->connected_means != NULL));
    assert(film->means || film->other_count == 0);
    if (film->means) {
        pool_means(film, other, sign);
        return;
    }
    for (size_t p = 0; p < (size_t)film->width * film->height; p++) {
        ca_pair_pixel *to = &film->pixels[p];
        const ca_pair_pixel *from = &other->pixels[p];
        for (int q = 0; q < CA_PAIR_QUANTITIES; q++) to->sums[q] += sign * from->sums[q];
        for (size_t q = 0; q < sizeof to->products / sizeof to->products[0]; q++)
            to->products[q] += sign * from->products[q];
        to->cubes += sign * from->cubes;
        to->fourths += sign * from->fourths;
        to->iterations = sign > 0 ? to->iterations + from->iterations : to->iterations - from->iterations;
    }
}
