@ Sums of coefficients over four by four nodes: see `spline` in cortex_m7.rs.
@
@ r0 coefficients   r1 bytes to the next line   r3, r12 four coefficients
@ lr, r2 sums along x of value and slope   r4-r7 parts along x: of the value, of the slope
@ r8 parts along y, value and slope   r9-r11 the three sums   s0 the sums' end
@ s1 bytes from the last line back to the next term   s2 sums   s4-s7 parts along y

    .syntax unified
    .fpu fpv4-sp-d16
    .section .itcm.hivtac_spline, "ax", %progbits
    .balign 8
    .global hivtac_spline
    .type hivtac_spline, %function
    .thumb_func

hivtac_spline:
    push   {r4-r11, lr}
    vldr   s0, [sp, #36]
    vmov   s1, r2
    vldmia r3, {s4-s11}
    vmov   s2, r0
    ldr    r0, [sp, #40]
    vmov   r4, r5, s8, s9
    vmov   r6, r7, s10, s11
    ldr    r3, [r0]
    ldr    r12, [r0, #4]
.Lhivtac_spline_term:
    smuad  lr, r3, r4
    add    r0, r0, r1
    smuad  r2, r3, r6
    ldr    r3, [r0]
    smlad  lr, r12, r5, lr
    vmov   r8, s4
    smlad  r2, r12, r7, r2
    ldr    r12, [r0, #4]
    smulwb r9, lr, r8
    add    r0, r0, r1
    smulwt r11, lr, r8
    smulwb r10, r2, r8
    smuad  lr, r3, r4
    vmov   r8, s5
    smuad  r2, r3, r6
    ldr    r3, [r0]
    smlad  lr, r12, r5, lr
    smlad  r2, r12, r7, r2
    ldr    r12, [r0, #4]
    smlawb r9, lr, r8, r9
    add    r0, r0, r1
    smlawt r11, lr, r8, r11
    smlawb r10, r2, r8, r10
    smuad  lr, r3, r4
    vmov   r8, s6
    smuad  r2, r3, r6
    ldr    r3, [r0]
    smlad  lr, r12, r5, lr
    smlad  r2, r12, r7, r2
    ldr    r12, [r0, #4]
    smlawb r9, lr, r8, r9
    smlawt r11, lr, r8, r11
    smlawb r10, r2, r8, r10
    smuad  lr, r3, r4
    vmov   r8, s7
    smuad  r2, r3, r6
    vmov   r3, s1
    smlad  lr, r12, r5, lr
    smlad  r2, r12, r7, r2
    add    r0, r0, r3
    smlawb r9, lr, r8, r9
    ldr    r3, [r0]
    smlawt r11, lr, r8, r11
    vmov   lr, s2
    smlawb r10, r2, r8, r10
    ldr    r12, [r0, #4]
    str    r9, [lr]
    vmov   r2, s0
    str    r11, [lr, #8]
    str    r10, [lr, #4]
    add    lr, lr, #12
    vmov   s2, lr
    cmp    lr, r2
    bne    .Lhivtac_spline_term
    pop    {r4-r11, pc}
    .size hivtac_spline, . - hivtac_spline
