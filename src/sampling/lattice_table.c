/* Two tables. The first are the components of "exod2_base2_m20_CKN", a generating vector for 2^10 to 2^20 points in
 * which all two-dimensional projections weigh the same (Cools, Kuo, Nuyens 2006, "Constructing embedded lattice rules
 * for multivariate integration", SIAM J. Sci. Comput. 28(6), 2162-2188; the numbers are those of Nuyens'
 * latticeseq_b2.py in his Magic Point Shop), less 106383 and 247945, in another order.
 *
 * Their criterion does not care about order, but a renderer does: it sees pairs of dimensions used together, and few
 * points. As published, some pairs (2 p, 2 p + 1) of 2^8 points lie on two lines. The order here comes from simulated
 * annealing of two sums, each dimension of vertex v weighing 1 / (1 + 0.3 v):
 * - over all pairs of dimensions: of e^2 over its median, m = 2 ... 16, where e^2 is the mean of B2(x) B2(y) over 2^m
 * points (B2(x) = x^2 - x + 1/6), and of s^-4 / 4, m = 17 ... 20, where s is the shortest vector of the projection's
 * dual lattice over that of the densest lattice. A pair used together weighs 200, others of its vertex 4 or 8, of
 * neighbouring vertices 0.5, and the rest 0.05;
 * - over the eight dimensions of each vertex and their small integer vectors h, those with r = prod(2 |h_j| of h_j !=
 * 0) no more than 32: (2^t / r)^1.5, where 2^t is the number of points up to which h is in the dual lattice. It
 * weighs 5.
 *
 * The second are further bits of the components, for more points: dimension by dimension the best of 1000 random
 * choices by s^-4 over m = 21 ... 48 with the same weights. */
#include "sampling/lattice_table.h"

const uint32_t ca_lattice_published[CA_LATTICE_DIMENSIONS] = {
    1, 422489, 471209, 480757, 40767, 366469, 519471, 279201, 55879, 297717, 365773, 58359, 428453, 515861,
    68195, 168691, 123963, 322505, 448107, 326437, 269423, 255369, 256763, 110653, 88779, 386241, 494245, 70841,
    417965, 139019, 463967, 101819, 19703, 348367, 110745, 64483, 132603, 408519, 337315, 32283, 250185, 445191,
    151243, 430359, 434045, 503455, 465711, 511925, 310163, 291637, 442243, 380427, 44167, 224183, 282267, 359529,
    209221, 341461, 433373, 452545, 147737, 406755, 61063, 182667, 246327, 459499, 69037, 339157, 152537, 479195,
    412621, 332981, 196113, 71105, 118515, 410745, 365117, 468881, 254701, 350845, 181873, 350241, 381007, 99703,
    316095, 243573, 279679, 249187, 254381, 283199, 121027, 19547, 118627, 17489, 200211, 128617, 238587, 7917,
    69681, 290275, 36237, 300129, 79397, 436179, 337729, 300343, 169189, 54641, 209585, 295679, 45067, 516695,
    33317, 169063, 341631, 122791, 238523, 362019, 201479, 487045, 492723, 245333, 5413, 172565, 125071, 80217,
    407559, 129509, 227069, 391023, 47719, 304803, 323871, 301397, 461527, 130789, 511437, 494585, 383599, 177975,
    182241, 369319, 317617, 469891, 84589, 402601, 14253, 417919, 147013, 425593, 102961, 250211, 442763, 49257,
    446433, 239429, 511893, 309001, 502917, 303633, 2555, 21693, 466581, 413283, 75401, 138655, 251851, 399185,
    141583, 481337, 245295, 316633, 423147, 420175, 239831, 10469, 40729, 204587, 223451, 217775, 437399, 142847,
    157383, 498753, 436695, 113217, 507865, 110205, 212061, 248047, 152143, 446247, 186077, 94631, 65989, 21175,
    170665, 189949, 43899, 26695, 410941, 108795, 320511, 477137, 10905, 181791, 368663, 266671, 442841, 73397,
    177457, 264647, 94049, 211325, 427191, 318855, 32569, 383435, 263355, 107405, 63371, 68143, 268793, 405485,
    237863, 94497, 126539, 385089, 9873, 143095, 113029, 291699, 399801, 442675, 51109, 98567, 66189, 388411,
    107311, 423927, 322721, 45669, 123925, 463959, 506099, 224015, 313395, 323179,
};

const uint32_t ca_lattice_upper[CA_LATTICE_DIMENSIONS] = {
    0xea235d38, 0xe6529cb0, 0x1d0e7aa4, 0xb39f596c, 0x262a196f, 0x94628577, 0xcc71dd97, 0x4f269dc1, 0x25eee614,
    0x6e0b3e01, 0x15862729, 0xb6326de3, 0x531c4a34, 0x369bb8fc, 0x4fff794c, 0xc0d9a7d0, 0x56f43480, 0xa5001f03,
    0x0b1f1f12, 0x77f70b08, 0x0a3c0abe, 0x65bcfdfb, 0x7b7b9f4e, 0xee4c4e12, 0x12fe9059, 0x4bb355fc, 0x5ade7564,
    0xd98a289a, 0x9c62aec5, 0x26751bf1, 0x909685f0, 0xbbe68667, 0x6cba9f6d, 0x541ba2ab, 0x066bffbf, 0x478567cc,
    0x66a0f9d6, 0xcc6b09e6, 0xbe70e805, 0xa8d07b29, 0x1059f7eb, 0xff0c97d1, 0xacd53a9f, 0x20d4b5f0, 0xaec04989,
    0x62e0dee9, 0x88dee349, 0xdad71596, 0x89a0b855, 0x39c37c4a, 0x7e5f8094, 0xfa07aba4, 0x28775b96, 0x4e1081b8,
    0xbb3c0176, 0x7cd052b8, 0x51974231, 0x44a53aa7, 0xf61075d1, 0x0fa3c86e, 0xdae6f890, 0x0a72b3af, 0x51eab424,
    0xe5eb5d53, 0x6a90c5d8, 0xbc507fe3, 0xd782f9fd, 0x28c266c9, 0x6d4587b7, 0x9258792a, 0x0d507b93, 0x81f973a1,
    0xc98447e0, 0xdcfbe5ce, 0x96564eaa, 0xc89ac0fe, 0xfea7b943, 0xa21d3aab, 0x9c45db21, 0x2931eb39, 0xa44a5c86,
    0xb9d421c5, 0x4526ea5e, 0x7742f2c6, 0x3b541bf6, 0x9da1a47f, 0x678ca365, 0x3c6c129c, 0x779e93c0, 0x60385ac8,
    0x0e795011, 0x2251911e, 0x0cb91453, 0x55c15b11, 0xc48d75df, 0xdd53c6c1, 0x7ab3a617, 0x233175f1, 0x57bae434,
    0x8198971a, 0x5b2b8477, 0x8bb646d0, 0x11281477, 0x44b2482f, 0x6d611db4, 0x81b2724f, 0x764d91ff, 0x0b5eab62,
    0x4d8606e3, 0x35f414b4, 0xe313c430, 0x842b1038, 0xbb973515, 0xf7ec60b3, 0xf9a30218, 0xa762233a, 0xa1c8c0c5,
    0x115b3b1f, 0xd957b1af, 0x47418c56, 0xd894b975, 0x8a86c485, 0x531bfb87, 0x2cf6c553, 0x80d27cf3, 0x684fc09c,
    0x4a5d205b, 0xd08415d5, 0x82a19f8c, 0xb8847f0f, 0x139fa4a2, 0x29a17723, 0xd586edf5, 0x8d3f6776, 0xfe1ff763,
    0x0c0fa4a5, 0x0d655811, 0x0cf8e1cc, 0x52104950, 0xe06399ac, 0x4c99d3ef, 0xaf891d6b, 0xc9d689bd, 0x009f5e38,
    0x44a3ab83, 0xdbd6b6aa, 0xe495de35, 0x73ba3bdf, 0x89ef53a7, 0xc4e0e3dc, 0x34e85b25, 0x2eef49a9, 0x759237d8,
    0xb7723433, 0x7faa3c87, 0x46dfc263, 0x6fa28eeb, 0xec9ab249, 0x6bb4ff3d, 0x51de2533, 0x0eedb0e0, 0x0abed70c,
    0x86b54f6d, 0x3511daa2, 0xb2f08375, 0x85de144a, 0x3bb1093f, 0xb9c53605, 0xb025ff96, 0xdbda84d2, 0xf9f219f5,
    0xf9c02382, 0x1724663d, 0xf7e4da30, 0xd18e9e02, 0xbbbbfa33, 0xb5361477, 0x6eb9bac8, 0x36c9cef2, 0x77c7a82c,
    0x945b9c34, 0x33d3e613, 0x87e92b3f, 0xed19d1fe, 0xb995e49c, 0xf04c4f29, 0x6d236e45, 0xa4c487c8, 0xe04164b0,
    0xb15af3a2, 0x7566ca7e, 0x07c793b2, 0xdcc101b5, 0x7008d0f1, 0x3105e00d, 0x5f23c764, 0x386bb7d3, 0x16eef41a,
    0xc192f168, 0xafa20d04, 0x6f7d91f7, 0xd6b3dfdd, 0xe7b0e7cf, 0x975bfc83, 0x3867ed1e, 0x65454fa2, 0xb19c7d44,
    0x33dc8d68, 0xfac29143, 0xf42d7a5d, 0x7fbd171d, 0xe621e007, 0x4978d1d4, 0x85c0c175, 0x1e409441, 0x3d150b25,
    0xdd82d813, 0xbd040f56, 0xf58b5d3e, 0x6ca8bf6a, 0x9c22253b, 0xf9db013c, 0xbd2022be, 0x160b0635, 0x32e39723,
    0x9fae607c, 0x53c385bc, 0x6d861ba2, 0x5ac1044b, 0xdcdee7ee, 0x4f111902, 0xb9224aa3, 0x53bafa26, 0x5cb226d7,
    0x58ce70ae, 0xe346c70f, 0x501fc4ff, 0xc2cc8b94, 0xb3e53267, 0x20a2e918, 0xf75517db, 0x0552c1c9, 0x250aa02a,
    0xf24d414c, 0x0ed08012, 0xbda127aa, 0x21f04e39, 0x5e7b183e,
};
