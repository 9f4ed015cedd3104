@ A square root: see `sqrt` in cortex_m7.rs.
@
@ s0 the square, then its root

    .syntax unified
    .fpu fpv4-sp-d16
    .section .itcm.hivtac_root, "ax", %progbits
    .balign 4
    .global hivtac_root
    .type hivtac_root, %function
    .thumb_func

hivtac_root:
    vsqrt.f32 s0, s0
    bx     lr
    .size hivtac_root, . - hivtac_root
