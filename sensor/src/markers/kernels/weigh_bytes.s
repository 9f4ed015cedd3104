@ The weights of a run of RGB565 pixels through a table of bytes, summed: see `weigh_bytes` in
@ cortex_m7.rs.
@
@ r0 behind the pixels left, then Σw   r1 table, then the sum of all sums so far   r2 pixels left
@ r3 Σw   r4-r7 pixels, then their bytes   r12 the sum of all sums so far
@
@ From right to left: first one, then two, where they are left over, then four at a time, all of
@ which are looked up before they are added.

    .syntax unified
    .section .itcm.hivtac_weigh_bytes, "ax", %progbits
    .balign 8
    .global hivtac_weigh_bytes
    .type hivtac_weigh_bytes, %function
    .thumb_func

hivtac_weigh_bytes:
    push   {r4-r7}
    movs   r3, #0
    mov.w  r12, #0
    lsls   r7, r2, #31
    beq    .Lhivtac_weigh_bytes_two
    ldrh   r4, [r0, #-2]!
    ldrb   r4, [r1, r4]
    lsr.w  r3, r4, #1
    mov    r12, r3
.Lhivtac_weigh_bytes_two:
    lsls   r7, r2, #30
    bpl    .Lhivtac_weigh_bytes_fours
    ldrh   r4, [r0, #-2]
    ldrh   r5, [r0, #-4]!
    ldrb   r4, [r1, r4]
    ldrb   r5, [r1, r5]
    add.w  r3, r3, r4, lsr #1
    add.w  r12, r12, r3
    add.w  r3, r3, r5, lsr #1
    add.w  r12, r12, r3
.Lhivtac_weigh_bytes_fours:
    lsrs   r2, r2, #2
    beq    .Lhivtac_weigh_bytes_end
.Lhivtac_weigh_bytes_four:
    ldrh   r4, [r0, #-2]
    ldrh   r7, [r0, #-8]
    ldrh   r6, [r0, #-6]
    ldrh   r5, [r0, #-4]
    subs   r2, r2, #1
    ldrb   r4, [r1, r4]
    sub.w  r0, r0, #8
    ldrb   r5, [r1, r5]
    ldrb   r6, [r1, r6]
    ldrb   r7, [r1, r7]
    add.w  r3, r3, r4, lsr #1
    add.w  r12, r12, r3
    add.w  r3, r3, r5, lsr #1
    add.w  r12, r12, r3
    add.w  r3, r3, r6, lsr #1
    add.w  r12, r12, r3
    add.w  r3, r3, r7, lsr #1
    add.w  r12, r12, r3
    bne    .Lhivtac_weigh_bytes_four
.Lhivtac_weigh_bytes_end:
    mov    r0, r3
    mov    r1, r12
    pop    {r4-r7}
    bx     lr
    .size hivtac_weigh_bytes, . - hivtac_weigh_bytes
