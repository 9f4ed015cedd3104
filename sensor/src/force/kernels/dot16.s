@ Sums of an int16 layer: see `dot16` in cortex_m7.rs for what it computes and why it cannot
@ overflow.
@
@ r0 weights   r1 inputs   r2-r5 sums of four rows   r6, r7 inputs of two columns each
@ r8-r11 weights, loaded ahead   r12 where sums go   lr blocks left
@ stack: inputs, blocks, end of sums
@
@ Schedule: every SMLAD goes with a load, so that both issue in one cycle; weights are loaded four
@ products, inputs two columns, before they are used.

    .syntax unified
    .section .itcm.hivtac_dot16, "ax", %progbits
    .balign 8
    .global hivtac_dot16
    .type hivtac_dot16, %function
    .thumb_func

@ Four columns of four rows, 16 products; \w and \x are the offsets of their weights and inputs in
@ the block.
.macro hivtac_dot16_columns w, x
    smlad  r2, r8, r6, r2
    ldr.w  r8, [r0, #\w + 16]
    smlad  r3, r9, r6, r3
    ldr.w  r9, [r0, #\w + 20]
    smlad  r4, r10, r6, r4
    ldr.w  r10, [r0, #\w + 24]
    smlad  r5, r11, r6, r5
    ldr.w  r11, [r0, #\w + 28]
    smlad  r2, r8, r7, r2
    ldr.w  r8, [r0, #\w + 32]
    smlad  r3, r9, r7, r3
    ldr.w  r9, [r0, #\w + 36]
    smlad  r4, r10, r7, r4
    ldr.w  r10, [r0, #\w + 40]
    smlad  r5, r11, r7, r5
    ldr.w  r11, [r0, #\w + 44]
    ldr.w  r6, [r1, #\x + 8]
    ldr.w  r7, [r1, #\x + 12]
.endm

hivtac_dot16:
    push   {r1, r2, r4-r11, lr}
    mov    r12, r3
    ldrd   r8, r9, [r0]
    ldrd   r10, r11, [r0, #8]
.Lhivtac_dot16_rows:
    ldrd   r1, lr, [sp]
    movs   r2, #0
    movs   r3, #0
    ldr    r6, [r1]
    movs   r4, #0
    ldr    r7, [r1, #4]
    movs   r5, #0
    .balign 8
.Lhivtac_dot16_block:
    hivtac_dot16_columns 0, 0
    hivtac_dot16_columns 32, 8
    hivtac_dot16_columns 64, 16
    hivtac_dot16_columns 96, 24
    add.w  r0, r0, #128
    subs.w lr, lr, #1
    add.w  r1, r1, #32
    bne.w  .Lhivtac_dot16_block
    ldr.w  lr, [sp, #44]
    stm    r12!, {r2-r5}
    cmp    r12, lr
    bne.w  .Lhivtac_dot16_rows
    pop    {r1, r2, r4-r11, pc}
    .size hivtac_dot16, . - hivtac_dot16

@ The same for up to 12 columns, whose inputs stay in registers.
@
@ r0 weights   r4-r9 inputs   r2, r3, r10, r11 weights and sums of two rows   r12 where sums go
@ lr their end
    .section .itcm.hivtac_dot16_narrow, "ax", %progbits
    .balign 8
    .global hivtac_dot16_narrow
    .type hivtac_dot16_narrow, %function
    .thumb_func

@ Two rows, 24 products; \w is the offset of their weights in the group, \s that of their sums.
.macro hivtac_dot16_narrow_rows w, s
    ldr.w  r2, [r0, #\w]
    ldr.w  r3, [r0, #\w + 4]
    smuad  r10, r2, r4
    ldr.w  r2, [r0, #\w + 16]
    smuad  r11, r3, r4
    ldr.w  r3, [r0, #\w + 20]
    smlad  r10, r2, r5, r10
    ldr.w  r2, [r0, #\w + 32]
    smlad  r11, r3, r5, r11
    ldr.w  r3, [r0, #\w + 36]
    smlad  r10, r2, r6, r10
    ldr.w  r2, [r0, #\w + 48]
    smlad  r11, r3, r6, r11
    ldr.w  r3, [r0, #\w + 52]
    smlad  r10, r2, r7, r10
    ldr.w  r2, [r0, #\w + 64]
    smlad  r11, r3, r7, r11
    ldr.w  r3, [r0, #\w + 68]
    smlad  r10, r2, r8, r10
    ldr.w  r2, [r0, #\w + 80]
    smlad  r11, r3, r8, r11
    ldr.w  r3, [r0, #\w + 84]
    smlad  r10, r2, r9, r10
    smlad  r11, r3, r9, r11
    str.w  r10, [r12, #\s]
    str.w  r11, [r12, #\s + 4]
.endm

hivtac_dot16_narrow:
    push   {r4-r11, lr}
    mov    r12, r2
    mov    lr, r3
    ldm    r1, {r4-r9}
.Lhivtac_dot16_narrow_group:
    hivtac_dot16_narrow_rows 0, 0
    hivtac_dot16_narrow_rows 8, 8
    add    r12, r12, #16
    add    r0, r0, #128
    cmp    r12, lr
    bne.w  .Lhivtac_dot16_narrow_group
    pop    {r4-r11, pc}
    .size hivtac_dot16_narrow, . - hivtac_dot16_narrow
