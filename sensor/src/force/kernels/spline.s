@ Terms over four by four nodes, times factors: see `spline` in cortex_m7.rs.
@
@ r0 coefficients   r1 bytes to the next line   r3, r12 four coefficients
@ lr, r2 sums along x of value and slope   r4-r7 parts along x: of the value, of the slope
@ r8 parts along y, value and slope   r9-r11 a term: value, slope along x, slope along y
@ s0 bytes from the last line back to the next term   s1, s2 factors, their end
@ s4-s7 parts along y   s8-s11 factors of the term before   s22-s24 that term
@ s12-s15, s25, s26 its products   s16-s21 the sums
@
@ The order is a search's, judged by LLVM's model of the core: 73 instructions and the branch,
@ and 42 cycles.

    .syntax unified
    .fpu fpv4-sp-d16
    .section .itcm.hivtac_spline, "ax", %progbits
    .balign 8
    .global hivtac_spline
    .type hivtac_spline, %function
    .thumb_func

hivtac_spline:
    push   {r4-r11, lr}
    vpush  {s16-s27}
    vmov   s0, r2
    vldr   s1, [sp, #84]
    vldr   s2, [sp, #88]
    vldmia r3, {s4-s7}
    mov    r9, #0
    ldrd   r4, r5, [r3, #16]
    ldrd   r6, r7, [r3, #24]
    vmov   s8, r9
    vmov   s9, r9
    vmov   s10, r9
    vmov   s11, r9
    vmov   s16, r9
    vmov   s17, r9
    vmov   s18, r9
    vmov   s19, r9
    vmov   s20, r9
    vmov   s21, r9
    vmov   s22, r9
    vmov   s23, r9
    vmov   s24, r9
    ldr    r3, [r0]
    ldr    r12, [r0, #4]
.Lhivtac_spline_term:
    add    r0, r0, r1
    vcvt.f32.s32 s22, s22
    vcvt.f32.s32 s24, s24
    vmov   r8, s4
    smuad  r2, r3, r6
    vcvt.f32.s32 s23, s23
    smuad  lr, r3, r4
    vmul.f32 s12, s22, s8
    vmov   r9, s1
    vmul.f32 s14, s22, s10
    smlad  lr, r12, r5, lr
    vmul.f32 s13, s22, s9
    vmul.f32 s25, s23, s8
    smlad  r2, r12, r7, r2
    vmul.f32 s15, s22, s11
    smulwt r11, lr, r8
    vmul.f32 s26, s24, s8
    smulwb r10, r2, r8
    vldr   s10, [r9, #8]
    vldr   s11, [r9, #12]
    ldr    r12, [r0, #4]
    ldr    r3, [r0]
    add    r0, r0, r1
    vldr   s8, [r9]
    vldr   s9, [r9, #4]
    add    r9, r9, #16
    smuad  r2, r3, r6
    vmov   s1, r9
    smulwb r9, lr, r8
    vmov   r8, s5
    smuad  lr, r3, r4
    vadd.f32 s17, s17, s13
    smlad  lr, r12, r5, lr
    ldr    r3, [r0]
    smlad  r2, r12, r7, r2
    smlawt r11, lr, r8, r11
    vadd.f32 s18, s18, s14
    smlawb r9, lr, r8, r9
    vadd.f32 s21, s21, s26
    smlawb r10, r2, r8, r10
    vmov   r8, s6
    smuad  r2, r3, r6
    ldr    r12, [r0, #4]
    smuad  lr, r3, r4
    smlad  lr, r12, r5, lr
    add    r0, r0, r1
    smlad  r2, r12, r7, r2
    smlawt r11, lr, r8, r11
    ldr    r3, [r0]
    smlawb r10, r2, r8, r10
    ldr    r12, [r0, #4]
    smlawb r9, lr, r8, r9
    smuad  lr, r3, r4
    vadd.f32 s20, s20, s25
    smuad  r2, r3, r6
    vmov   r8, s7
    smlad  r2, r12, r7, r2
    vmov   r3, s0
    smlad  lr, r12, r5, lr
    vadd.f32 s16, s16, s12
    smlawb r10, r2, r8, r10
    vadd.f32 s19, s19, s15
    smlawt r11, lr, r8, r11
    add    r0, r0, r3
    smlawb r9, lr, r8, r9
    vmov   s24, r11
    vmov   s23, r10
    vmov   r10, s1
    vmov   r11, s2
    vmov   s22, r9
    ldr    r3, [r0]
    cmp    r10, r11
    ldr    r12, [r0, #4]
    bne.w  .Lhivtac_spline_term
    vcvt.f32.s32 s22, s22
    vcvt.f32.s32 s23, s23
    vcvt.f32.s32 s24, s24
    vmul.f32 s12, s22, s8
    vmul.f32 s13, s22, s9
    vmul.f32 s14, s22, s10
    vmul.f32 s15, s22, s11
    vmul.f32 s25, s23, s8
    vmul.f32 s26, s24, s8
    vadd.f32 s16, s16, s12
    vadd.f32 s17, s17, s13
    vadd.f32 s18, s18, s14
    vadd.f32 s19, s19, s15
    vadd.f32 s20, s20, s25
    vadd.f32 s21, s21, s26
    ldr    r0, [sp, #92]
    vstmia r0, {s16-s21}
    vpop   {s16-s27}
    pop    {r4-r11, pc}
    .size hivtac_spline, . - hivtac_spline
